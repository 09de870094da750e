"""What `grouser skid-steer` does: drive the recorded drives again in the simulator, and compare."""

from dataclasses import dataclass

import numpy as np
from rich.table import Table

from grouser.envs.simulation.tracks import TrackModel
from grouser.estimators.evaluation.plots import require_matplotlib
from grouser.geometry import Array
from grouser.scripts.skid_steer import SkidSteer
from grouser.scripts.skid_steer_plot import draw
from grouser.scripts.skid_steer_runs import Run, read_runs, speed_ratio, yaw_efficiency
from grouser.scripts.skid_steer_simulation import (
    SOILS,
    TRACK,
    WHEELS,
    drive_again,
    with_lateral_factor,
)
from grouser.scripts.terminal import table_console
from grouser.scripts.usage import usage_errors

LATERAL_FACTORS = (1.0, 1.2, 1.4, 1.6, 1.8, 2.0)
"""Tried ratios of lateral to longitudinal force: 1 is plain friction; tyres with lugs, and wheels
that push a wall of soil before their flanks, have more."""


@dataclass(frozen=True)
class Variant:
    """A contact with the ground, and the efficiency (factor,) at each of LATERAL_FACTORS."""

    name: str
    tracks: TrackModel
    soil: str
    efficiency: Array


def compare_with_recordings(options: SkidSteer) -> int:
    """Compare, print both tables, draw, and return the exit code."""
    with usage_errors():
        if not options.no_plots:
            require_matplotlib()
            options.output.mkdir(parents=True, exist_ok=True)
        runs = read_runs(options.data)
    real = np.array([yaw_efficiency(run.position, run.yaw_rate) for run in runs])
    variants = simulate(runs)
    chosen, factor = _nearest(variants[0], real)
    again = [drive_again(run, chosen, variants[0].soil) for run in runs]
    console = table_console()
    console.print(_real_table(runs, again, f"{variants[0].name}, lateral factor {factor:.1f}"))
    console.print(_simulated_table(variants, real))
    console.print(verdict(variants, real))
    if not options.no_plots:
        path = options.output / "skid-steer.png"
        simulated = {variant.name: variant.efficiency for variant in variants}
        draw(path, runs, again, real, LATERAL_FACTORS, simulated)
        console.print(f"plot: {path}")
    return 0


def simulate(runs: list[Run]) -> list[Variant]:
    """On wheels on every soil; and on tracks, which bear evenly, on gravel."""
    contacts = [(f"wheels, {soil}", WHEELS, soil) for soil in SOILS]
    contacts.append(("tracks, gravel", TRACK, "gravel"))
    return [
        Variant(name, tracks, soil, _efficiencies(runs, tracks, soil))
        for name, tracks, soil in contacts
    ]


def _efficiencies(runs: list[Run], tracks: TrackModel, soil: str) -> Array:
    """(factor,) means over the drives."""
    return np.array(
        [
            np.mean(
                [
                    yaw_efficiency(
                        drive_again(run, with_lateral_factor(tracks, factor), soil), run.yaw_rate
                    )
                    for run in runs
                ]
            )
            for factor in LATERAL_FACTORS
        ]
    )


def in_range(efficiency: Array, real: Array) -> Array:
    """Which of the simulated efficiencies lie between the least and the most of the real ones."""
    return np.asarray((efficiency >= real.min()) & (efficiency <= real.max()))


def verdict(variants: list[Variant], real: Array) -> str:
    """One sentence a variant: with which lateral factors it turns as little as the real robot."""
    sentences = []
    for variant in variants:
        fitting = np.array(LATERAL_FACTORS)[in_range(variant.efficiency, real)]
        if len(fitting):
            found = f"within the real range at lateral factors {_list(fitting)}"
        else:
            nearest = variant.efficiency[np.argmin(np.abs(variant.efficiency - real.mean()))]
            found = f"never within the real range: the nearest is {nearest:.2f}"
        sentences.append(f"{variant.name}: {found}")
    return "\n".join(sentences)


def _list(factors: Array) -> str:
    return ", ".join(f"{factor:.1f}" for factor in factors)


def _nearest(variant: Variant, real: Array) -> tuple[TrackModel, float]:
    """The variant's contact with the lateral factor that turns most like the real robot."""
    factor = LATERAL_FACTORS[int(np.argmin(np.abs(variant.efficiency - real.mean())))]
    return with_lateral_factor(variant.tracks, factor), factor


def _real_table(runs: list[Run], again: list[Array], variant: str) -> Table:
    table = Table(
        title=f"What the robot did, over what its wheels said\nrecorded, and simulated on {variant}"
    )
    table.add_column("drive")
    for name in ("yaw rate", "simulated", "speed", "simulated"):
        table.add_column(name, justify="right")
    for run, position in zip(runs, again, strict=True):
        table.add_row(
            run.name,
            f"{yaw_efficiency(run.position, run.yaw_rate):.3f}",
            f"{yaw_efficiency(position, run.yaw_rate):.3f}",
            f"{speed_ratio(run.position, run.speed):.3f}",
            f"{speed_ratio(position, run.speed):.3f}",
        )
    return table


def _simulated_table(variants: list[Variant], real: Array) -> Table:
    table = Table(
        title="Simulated yaw efficiency by lateral factor\n"
        f"(* within the recorded {real.min():.2f} to {real.max():.2f})"
    )
    table.add_column("contact, ground")
    for factor in LATERAL_FACTORS:
        table.add_column(f"{factor:.1f}", justify="right")
    for variant in variants:
        marks = in_range(variant.efficiency, real)
        cells = [
            f"{value:.3f}{'*' if mark else ' '}"
            for value, mark in zip(variant.efficiency, marks, strict=True)
        ]
        table.add_row(variant.name, *cells)
    return table
