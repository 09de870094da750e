"""What a run of the Monte Carlo is worth, and the means over its seeds."""

from collections.abc import Iterable
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np


@dataclass(frozen=True, slots=True)
class Score:
    """How one method did on one drive."""

    scenario: str
    method: str
    seed: int
    mm: float
    """Position error at the end."""
    degrees: float
    """Heading error at the end, absolute."""
    rms_mm: float
    """Of the position over the drive."""
    nees: float
    """Of the pose, mean over the drive; 3 if the covariance is honest."""
    tracking: float
    """Share of the frames."""
    ms: float
    """A frame, processor time of one thread, median."""

    def plain(self) -> dict[str, Any]:
        """For JSON."""
        return asdict(self)


@dataclass(frozen=True, slots=True)
class Mean:
    """The means of one method's scores in one scenario."""

    scenario: str
    method: str
    seeds: int
    mm: float
    degrees: float
    rms_mm: float
    nees: float
    tracking: float
    ms: float

    def plain(self) -> dict[str, Any]:
        """For JSON."""
        return asdict(self)


def summarise(scores: Iterable[Score]) -> dict[tuple[str, str], Mean]:
    """By scenario and method, in the order in which they come."""
    groups: dict[tuple[str, str], list[Score]] = {}
    for score in scores:
        groups.setdefault((score.scenario, score.method), []).append(score)
    return {key: _mean(*key, group) for key, group in groups.items()}


def _mean(scenario: str, method: str, scores: list[Score]) -> Mean:
    names = ("mm", "degrees", "rms_mm", "nees", "tracking", "ms")
    means = {name: float(np.mean([getattr(s, name) for s in scores])) for name in names}
    return Mean(scenario, method, len(scores), **means)
