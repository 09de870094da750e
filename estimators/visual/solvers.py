"""Minimal solvers by name."""

from collections.abc import Callable

from grouser.estimators.visual.disparity_space import DisparitySpace
from grouser.estimators.visual.five_point import FivePointRansac
from grouser.estimators.visual.histogram_voting import HistogramVoting
from grouser.estimators.visual.one_point import OnePointRansac
from grouser.estimators.visual.solver import MotionSolver
from grouser.estimators.visual.three_point import ThreePointRansac
from grouser.estimators.visual.two_point import TwoPointRansac
from grouser.rig import StereoCamera

SOLVERS: dict[str, Callable[[StereoCamera], MotionSolver]] = {
    "one-point": OnePointRansac,
    "histogram": HistogramVoting,
    "two-point": TwoPointRansac,
    "three-point": ThreePointRansac,
    "disparity-space": DisparitySpace,
    "five-point": FivePointRansac,
}


def make_solver(name: str, camera: StereoCamera) -> MotionSolver:
    """The solver of that name.

    Raises:
        ValueError: there is none.
    """
    if name not in SOLVERS:
        raise ValueError(f"no solver is named {name!r}; known: {', '.join(sorted(SOLVERS))}")
    return SOLVERS[name](camera)
