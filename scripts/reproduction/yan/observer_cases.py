"""Bisection beside the closed form on random segments: does it see what there is, and exactly?"""

from dataclasses import dataclass

import numpy as np

from grouser.envs.sensors.line_observer import (
    BisectionObserver,
    ClosedFormObserver,
    PointByPointObserver,
)
from grouser.geometry import Array
from grouser.scripts.reproduction.experiment import Experiment, OnPart, Outcome
from grouser.scripts.reproduction.figures import Figures

NAME = "observer-cases"
TOLERANCE = 1e-3  # m
_SPACING = 0.1  # m
_REACH = 30.0  # m
_AREA = 60.0  # m: ends lie within so much of the robot, in x and y


@dataclass(frozen=True, slots=True)
class ObserverCases(Experiment):
    """Random segments around a robot."""

    cases: int
    name: str = NAME

    def run(self, on_part: OnPart) -> Outcome:
        """One number a name."""
        segments = random_segments(np.random.default_rng(0), self.cases)
        exact = ClosedFormObserver().observe(segments, (0.0, 0.0), _REACH)
        bisection = BisectionObserver(tolerance=TOLERANCE).observe(segments, (0.0, 0.0), _REACH)
        points = PointByPointObserver(spacing=_SPACING).observe(segments, (0.0, 0.0), _REACH)
        on_part()
        return {
            "cases": np.array(len(segments)),
            "visible": np.array(np.isfinite(exact[:, 0]).sum()),
            "mismatches": np.array(_mismatches(exact, bisection)),
            "worst_m": np.array(_worst(segments, exact, bisection)),
            "points_mismatches": np.array(_mismatches(exact, points)),
            "points_worst_m": np.array(_worst(segments, exact, points)),
        }


def observer_figures(outcome: Outcome) -> Figures:
    """What was found."""
    return {f"observer.{name}": float(value) for name, value in outcome.items()}


def random_segments(rng: np.random.Generator, n: int) -> Array:
    """(n, 4) m: most of them anywhere, some short."""
    segments = rng.uniform(-_AREA, _AREA, (n, 4))
    short = rng.random(n) < 0.2
    segments[short, 2:] = segments[short, :2] + rng.normal(size=(short.sum(), 2))
    return np.asarray(segments)


def _mismatches(exact: Array, other: Array) -> int:
    """Segments of which one says that there is something to see and one that there is not."""
    return int((np.isfinite(exact[:, 0]) != np.isfinite(other[:, 0])).sum())


def _worst(segments: Array, exact: Array, other: Array) -> float:
    """m between ends of the visible parts."""
    lengths = np.linalg.norm(segments[:, 2:] - segments[:, :2], axis=1)
    return float(np.nanmax(np.abs(exact - other) * lengths[:, None]))
