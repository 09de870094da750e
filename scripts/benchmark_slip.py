"""How well the effective width of the simulated robot is estimated, on one ground after another."""

from dataclasses import dataclass
from functools import cache
from typing import Any

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

import grouser  # noqa: F401  (registers the environments)
from grouser.agents.scripted import figure_eight
from grouser.estimators import make
from grouser.estimators.random_stream import estimator_rng
from grouser.geometry import Array
from grouser.rig import Rig
from grouser.scripts.benchmark_timing import Figures, Measurement

TERRAINS = ("asphalt", "cement", "gravel", "grass")
_STEPS, _SEEDS = 275, (1, 2)
_TOLD = 0.5
"""m: the effective width that the rig says, 15 % from the true one"""
_SETTLED = 10
"""Steps after which a new curve is steady. (The second one lasts until the end.)"""
_ESTIMATORS: dict[str, tuple[str, dict[str, str]]] = {
    "icr_ekf": ("icr-ekf", {"source": "one-point-ransac"}),
    "vision": ("one-point-ransac", {}),
}


@dataclass(frozen=True, slots=True)
class _Drive:
    rig: Rig
    observations: list[dict[str, NDArray[Any]]]
    widths: Array
    """(n,) true, m; NaN where the robot goes straight"""
    turn_rates: Array
    """(n,) rad/s"""


def widths_found() -> Figures:
    """Error of the mean width in steady turns of the second half of a figure-eight; mean of seeds.

    And how far a single frame is off, as a root mean square over all of them.
    """
    figures: Figures = {}
    for name in _ESTIMATORS:
        frames = []
        for terrain in TERRAINS:
            drives = [_drive(terrain, seed) for seed in _SEEDS]
            errors = [_errors(name, drive) for drive in drives]
            of_mean = np.mean([abs(np.mean(error)) for error in errors])
            figures[f"slip.width_{name}_{terrain}"] = (100 * float(of_mean), "%")
            frames += errors
        rms = float(np.sqrt(np.mean(np.concatenate(frames) ** 2)))
        figures[f"slip.width_{name}_frame"] = (100 * rms, "%")
    return figures


def _errors(name: str, drive: _Drive) -> Array:
    """(m,) relative error of the width in steady turns of the second half."""
    estimator_name, options = _ESTIMATORS[name]
    told = drive.rig.with_overrides({"tracks.effective_width": _TOLD})
    estimator = make(estimator_name, told, **options)
    estimator.reset(drive.observations[0], rng=estimator_rng(0))
    found = [
        estimator.update(seen).diagnostics["effective_width"] for seen in drive.observations[1:]
    ]
    steady = _steady(drive.turn_rates)[1:]
    steady[: len(steady) // 2] = False
    return np.asarray(np.array(found)[steady] / drive.widths[1:][steady] - 1)


def _steady(turn_rates: Array) -> NDArray[np.bool_]:
    """Where the robot has turned the same way for a while, and does not yet slow down."""
    sides, rates = np.sign(turn_rates), np.abs(turn_rates)
    same = [np.all(sides[max(k - _SETTLED, 0) : k + 1] == side) for k, side in enumerate(sides)]
    steady: NDArray[np.bool_] = np.logical_and(same, rates > 0.8 * rates.max())
    return steady


@cache
def _drive(terrain: str, seed: int) -> _Drive:
    env = gym.make(
        "grouser/TrackedRobot-v0",
        terrain=terrain,
        sensors=("left", "right", "tracks"),
        dynamics="fast",
    )
    seen, info = env.reset(seed=seed)
    rig = env.get_wrapper_attr("rig")
    action, observations, infos = figure_eight(rig), [seen], [info]
    for step in range(_STEPS):
        seen, _, _, _, info = env.step(action(step).astype(np.float32))
        observations.append(seen)
        infos.append(info)
    env.close()
    widths = np.array([told["effective_width"] for told in infos])
    return _Drive(rig, observations, widths, np.array([told["true_twist"][2] for told in infos]))


MEASUREMENTS = (
    Measurement(
        widths_found,
        tuple(f"slip.width_{name}_{what}" for name in _ESTIMATORS for what in (*TERRAINS, "frame")),
    ),
)
