"""Minimal solvers on synthetic matches: what they find, how well, and how fast.

A solver's hypothesis is refined as visual odometry does it, by the same code for all.
"""

import time
from collections.abc import Callable
from dataclasses import dataclass, fields

import numpy as np

from grouser.estimators.visual.motion import intrinsics
from grouser.estimators.visual.refine import refine
from grouser.estimators.visual.solver import MotionSolver
from grouser.estimators.visual.solvers import SOLVERS, make_solver
from grouser.geometry import Array
from grouser.scripts.reproduction.experiment import Experiment, OnPart, Outcome
from grouser.scripts.reproduction.zhao.synthetic import Scene, planar, scene, spec_camera

COMPARED = ("one-point", "two-point", "three-point", "five-point")
"""By the size of their minimal samples, where they exist."""

OUTLIER_RATIOS = np.round(np.arange(0.0, 0.81, 0.1), 1)
SIDE_SLIPS = np.array([0.0, 0.02, 0.05, 0.1, 0.15, 0.2, 0.3, 0.4])
"""Way to the side over the way ahead."""

_SLIP_OUTLIERS = 0.2
_FEWEST = 6  # inliers that visual odometry asks of a hypothesis
_WARM_UP = 3


def compared() -> tuple[str, ...]:
    """The solvers that there are."""
    return tuple(name for name in COMPARED if name in SOLVERS)


@dataclass(frozen=True, slots=True)
class _Trial:
    """What a solver made of one scene; NaN where it found nothing."""

    recall: float
    """Share of the right matches that it takes for right."""
    precision: float
    """Share of those that it takes for right that are."""
    turn_error: float
    """rad, refined"""
    place_error: float
    """m, refined"""
    ms: float
    """Of the solver alone."""


@dataclass(frozen=True, slots=True)
class OutlierTrials(Experiment):
    """Every solver at every outlier ratio."""

    trials: int
    name: str = "solvers-outliers"

    @property
    def parts(self) -> int:
        return len(OUTLIER_RATIOS)

    @property
    def measures_time(self) -> bool:
        return True

    def run(self, on_part: OnPart) -> Outcome:
        """`SOLVER.FIGURE` (ratio, trial), figures as in _Trial."""
        return _run(
            lambda rng, ratio: _scene(rng, ratio, 0.0), OUTLIER_RATIOS, self.trials, on_part
        )


@dataclass(frozen=True, slots=True)
class SlipTrials(Experiment):
    """Every solver at every side slip that nobody told it of."""

    trials: int
    name: str = "solvers-slip"

    @property
    def parts(self) -> int:
        return len(SIDE_SLIPS)

    @property
    def measures_time(self) -> bool:
        return True

    def run(self, on_part: OnPart) -> Outcome:
        """`SOLVER.FIGURE` (slip, trial), figures as in _Trial."""
        return _run(
            lambda rng, slip: _scene(rng, _SLIP_OUTLIERS, slip), SIDE_SLIPS, self.trials, on_part
        )


_CAMERA = spec_camera(0.2)


def _scene(rng: np.random.Generator, outlier_ratio: float, slip: float) -> tuple[Scene, Array]:
    turn, chord = rng.uniform(-0.1, 0.1), rng.uniform(0.05, 0.25)
    motion = planar(turn, chord, slip * chord * rng.choice([-1.0, 1.0]))
    return scene(rng, _CAMERA, motion, outlier_ratio=outlier_ratio), motion


def _run(
    draw: Callable[[np.random.Generator, float], tuple[Scene, Array]],
    amounts: Array,
    trials: int,
    on_part: OnPart,
) -> Outcome:
    names = compared()
    solvers = {name: make_solver(name, _CAMERA) for name in names}
    figures = [field.name for field in fields(_Trial)]
    values = {f"{n}.{f}": np.empty((len(amounts), trials)) for n in names for f in figures}
    for _ in range(_WARM_UP):
        drawn, motion = draw(np.random.default_rng(0), amounts[0])
        for solver in solvers.values():
            _try(solver, drawn, motion, np.random.default_rng(0))
    for row, amount in enumerate(amounts):
        rng = np.random.default_rng(row)
        for trial in range(trials):
            drawn, motion = draw(rng, amount)
            for name, solver in solvers.items():
                tried = _try(solver, drawn, motion, np.random.default_rng(trial))
                for figure in figures:
                    values[f"{name}.{figure}"][row, trial] = getattr(tried, figure)
        on_part()
    return values


def _try(solver: MotionSolver, drawn: Scene, motion: Array, rng: np.random.Generator) -> _Trial:
    began = time.perf_counter()
    found = solver.solve(drawn.matches, drawn.prior, rng)
    ms = 1e3 * (time.perf_counter() - began)
    if found is None or found.inliers.sum() < _FEWEST:
        return _Trial(0.0, np.nan, np.nan, np.nan, ms)
    refined = refine(
        drawn.matches.reference,
        drawn.matches.current,
        start=found.motion,
        supporters=found.inliers,
        prior=drawn.prior,
        noise=drawn.matches.noise,
        T_base_camera=_CAMERA.T_base_camera,
        camera=intrinsics(_CAMERA),
    )
    right = found.inliers & drawn.right
    return _Trial(
        recall=float(right.sum() / max(drawn.right.sum(), 1)),
        precision=float(right.sum() / found.inliers.sum()),
        turn_error=float(abs(refined.motion[0] - motion[0])),
        place_error=float(np.hypot(*(refined.motion[1:3] - motion[1:3]))),
        ms=ms,
    )
