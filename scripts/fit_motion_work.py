"""What `grouser fit-motion` does: drive twice, compare the slip, fit the ground."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from rich.table import Table
from scipy.stats import ks_2samp

from grouser.envs.simulation.materials import MATERIAL_NAMES, material_index
from grouser.estimators.evaluation.folder import write_json
from grouser.estimators.evaluation.plots import require_matplotlib
from grouser.geometry import Array
from grouser.scripts.fit_motion import FitMotion
from grouser.scripts.fit_motion_plot import draw
from grouser.scripts.motion_drives import (
    MEASURES,
    Setting,
    commands,
    drive,
    settings,
    slips,
    twists,
)
from grouser.scripts.motion_fit import PARAMETERS, Fit, fit
from grouser.scripts.terminal import progress, table_console
from grouser.scripts.usage import UsageError, usage_errors

_LEVELS = (0.05, 0.25, 0.5, 0.75, 0.95)


@dataclass(frozen=True, slots=True, eq=False)
class Pair:
    """Slip in the same drive by both dynamics, samples by MEASURES."""

    setting: Setting
    bullet: dict[str, Array]
    fast: dict[str, Array]

    def distance(self, measure: str) -> float:
        """Kolmogorov and Smirnov's: the most that the shares below a value differ, 0 to 1."""
        return float(ks_2samp(self.bullet[measure], self.fast[measure], method="asymp").statistic)

    def quantiles(self, measure: str) -> tuple[Array, Array]:
        """Those of _LEVELS, by Bullet and by the light model."""
        return (
            np.quantile(self.bullet[measure], _LEVELS),
            np.quantile(self.fast[measure], _LEVELS),
        )

    def farthest(self, measure: str) -> float:
        """The most that quantiles of 5 to 95 % are apart."""
        bullet, fast = self.quantiles(measure)
        return float(np.abs(fast - bullet).max())


def fit_motion(options: FitMotion) -> int:
    """Drive, compare, fit, print both tables, draw, and return the exit code."""
    with usage_errors():
        terrains = _checked_terrains(options.terrains)
        if not options.no_plots:
            require_matplotlib()
        options.output.mkdir(parents=True, exist_ok=True)
    speeds = commands()
    pairs, fits = [], []
    where = settings(terrains)
    with progress("", len(where)) as bar:
        for setting in bar.over(where):
            bar.describe(setting.terrain)
            pair, motion = compare(setting, speeds)
            pairs.append(pair)
            if setting.slope:  # only there does resistance tell itself from lag
                fits.append(fit(setting, speeds, motion))
    write_json(options.output / "agreement.json", _told(pairs, fits))
    console = table_console()
    console.print(_slip_table(pairs))
    console.print(_fit_table(fits))
    if not options.no_plots:
        path = options.output / "motion.png"
        draw(path, pairs, fits)
        console.print(f"plot: {path}")
    return 0


def compare(setting: Setting, speeds: Array) -> tuple[Pair, Array]:
    """Both drives, and the twists (n, 3) of Bullet's."""
    bullet, fast = (drive(setting, speeds, dynamics=name) for name in ("bullet", "fast"))
    return Pair(setting, slips(bullet), slips(fast)), twists(bullet)


def _checked_terrains(names: tuple[str, ...] | None) -> tuple[str, ...]:
    """Those to drive on: all where none are named."""
    if names is None:
        return MATERIAL_NAMES
    if not names:
        raise UsageError("--terrains takes one name or more")
    for name in names:
        material_index(name)  # says what is wrong with one that there is not
    return names


def _told(pairs: Sequence[Pair], fits: Sequence[Fit]) -> dict[str, object]:
    return {
        "slip": [
            {
                "terrain": pair.setting.terrain,
                "slope": pair.setting.slope,
                "measure": measure,
                "ks_distance": pair.distance(measure),
                "levels": list(_LEVELS),
                "bullet": pair.quantiles(measure)[0].tolist(),
                "fast": pair.quantiles(measure)[1].tolist(),
            }
            for pair in pairs
            for measure in MEASURES
        ],
        "fit": [
            {
                "terrain": found.terrain,
                "factors": dict(zip(PARAMETERS, found.factors.tolist(), strict=True)),
                "sigmas": dict(zip(PARAMETERS, found.sigmas.tolist(), strict=True)),
                "rms": found.rms.tolist(),
            }
            for found in fits
        ],
    }


def _slip_table(pairs: Sequence[Pair]) -> Table:
    table = Table(
        title="Slip in the same drives, Bullet / light model: medians, Kolmogorov-Smirnov distance"
    )
    table.add_column("ground", no_wrap=True)
    table.add_column("slope\nrad", justify="right")
    for name in MEASURES:
        table.add_column(name, justify="right")
        table.add_column("KS", justify="right")
    for pair in pairs:
        cells = []
        for name in MEASURES:
            bullet, fast = (part[2] for part in pair.quantiles(name))
            cells += [f"{bullet:.4f} / {fast:.4f}", f"{pair.distance(name):.3f}"]
        table.add_row(pair.setting.terrain, f"{pair.setting.slope:g}", *cells)
    return table


def _fit_table(fits: Sequence[Fit]) -> Table:
    table = Table(
        title="The ground fitted to Bullet's motion, over the one that both dynamics share\n"
        "(1 is the same), and what differs then (RMS)"
    )
    table.add_column("ground", no_wrap=True)
    for name in PARAMETERS:
        table.add_column(name.replace("_", " "), justify="right")
    for name in ("mm/s forward", "mm/s left", "mrad/s"):
        table.add_column(name, justify="right")
    for found in fits:
        factors = [
            f"{value:.3f} ±{sigma:.3f}"
            for value, sigma in zip(found.factors, found.sigmas, strict=True)
        ]
        table.add_row(found.terrain, *factors, *(f"{1e3 * value:.1f}" for value in found.rms))
    return table
