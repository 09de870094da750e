"""The picture of `grouser fit-motion`: distributions of slip by both dynamics, and the fit."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from grouser.geometry import Array
from grouser.scripts.motion_drives import MEASURES
from grouser.scripts.motion_fit import PARAMETERS, Fit

if TYPE_CHECKING:
    from grouser.scripts.fit_motion_work import Pair


def draw(path: Path, pairs: Sequence["Pair"], fits: Sequence[Fit]) -> None:
    """Write a PNG: for each measure the share of samples below a value on every level ground, lines
    by Bullet and dots by the light model; and the fitted grounds."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(11, 7), layout="constrained")
    grid = figure.subplots(2, 2).ravel()
    level = [pair for pair in pairs if not pair.setting.slope]
    for axes, (measure, words) in zip(grid, MEASURES.items(), strict=False):
        for k, pair in enumerate(level):
            axes.plot(*_cumulated(pair.bullet[measure], 201), f"C{k}-", label=pair.setting.terrain)
            axes.plot(*_cumulated(pair.fast[measure], 21), f"C{k}o", markersize=3)
        axes.set(xlabel=words, ylabel="share of samples", ylim=(0, 1))
        axes.grid(alpha=0.3)
    grid[0].legend(fontsize="small", title="lines: Bullet, dots: light")
    grid[3].axhline(1.0, color="0.6")
    at = np.arange(len(fits))
    for k, name in enumerate(PARAMETERS):
        grid[3].errorbar(
            at + 0.15 * (k - 1),
            [found.factors[k] for found in fits],
            [2 * found.sigmas[k] for found in fits],
            fmt="o", capsize=2, label=name.replace("_", " "),
        )  # fmt: skip
    grid[3].set_xticks(at, [found.terrain for found in fits])
    grid[3].set(ylabel="fitted to Bullet, over the shared one")
    grid[3].legend(fontsize="small", title="bars: 2 sigma")
    grid[3].grid(alpha=0.3)
    figure.savefig(path, dpi=110)


def _cumulated(samples: Array, n: int) -> tuple[Array, Array]:
    shares = np.linspace(0.005, 0.995, n)
    return np.quantile(samples, shares), shares
