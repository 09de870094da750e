"""The picture of `grouser skid-steer`."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from grouser.geometry import Array
from grouser.scripts.skid_steer_runs import DT, Run, course

_SMOOTHED = 30
"""Rows over which the courses are averaged for the picture."""


def draw(
    path: Path,
    runs: Sequence[Run],
    again: Sequence[Array],
    real: Array,
    factors: Sequence[float],
    simulated: Mapping[str, Array],
) -> None:
    """Write a PNG: simulated efficiencies in the recorded range; yaw rates over time.

    Args:
        again: positions (n, 2) of the simulated robot in each run, m.
        real: (run,) recorded efficiencies.
        simulated: efficiency (factor,) by name.
    """
    from matplotlib.figure import Figure

    figure = Figure(figsize=(11, 4.5), layout="constrained")
    left, right = figure.subplots(1, 2)
    left.axhspan(real.min(), real.max(), color="0.85", label="recorded, all drives")
    for name, efficiency in simulated.items():
        style = "--" if name.startswith("tracks") else "-"
        left.plot(factors, efficiency, style, marker="o", markersize=3, label=name)
    left.set(xlabel="lateral over longitudinal force", ylabel="yaw efficiency", ylim=(0, 1))
    left.legend(fontsize="small")
    left.set_title("Turned, over what the wheels say")
    colours = [f"C{k}" for k in range(len(runs))]
    for colour, run, position, efficiency in zip(colours, runs, again, real, strict=True):
        right.plot(*_turning(run.position), color=colour, label=f"{run.name}: {efficiency:.2f}")
        right.plot(*_turning(position), "--", color=colour)
        right.plot(DT * np.arange(len(run.yaw_rate)), np.abs(run.yaw_rate), ":", color=colour)
    right.set(xlabel="time [s]", ylabel="yaw rate [rad/s]", ylim=(0, None))
    right.legend(fontsize="small")
    right.set_title("Recorded (lines), simulated (dashed), wheels (dotted)")
    figure.savefig(path, dpi=120)


def _turning(position: Array) -> tuple[Array, Array]:
    """Times and the rate at which the course turns, averaged."""
    directions = course(position)
    turned = np.abs(directions[_SMOOTHED:] - directions[:-_SMOOTHED])
    time = DT * (np.arange(len(turned), dtype=np.float64) + _SMOOTHED / 2)
    return time, turned / (DT * _SMOOTHED)
