"""Are the disparities off by a constant? What many keyframes say of it together."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from grouser.estimators.visual.structure import OffsetEvidence

SYSTEMATIC = 0.02
"""px, one sigma of what all keyframes have in common: interpolation misreads all disparities by so
much (a test of the alignment measures it), and so do the lenses' residual distortions."""
SUSPECT = 3.5
"""Sigmas by which the estimate must differ from zero."""

_FEWEST = 4  # keyframes, before their scatter says how sure they are
_MEMORY = 100  # keyframes: a rectification drifts with the temperature
_SCATTER = 0.04  # px: two keyframes differ by so much beyond their own sigmas
_OUTLIER = 3.0  # sigmas beyond which a keyframe's weight falls


@dataclass(frozen=True, slots=True)
class OffsetEstimate:
    """Measured minus true disparity, beyond what the rig says."""

    offset: float
    """px"""
    sigma: float
    """px"""

    @property
    def suspect(self) -> bool:
        """Whether the rig's disparity offset is contradicted."""
        return bool(abs(self.offset) > SUSPECT * self.sigma)


class OffsetWatch:
    """The mean of what keyframes say, as sure as they agree with each other, and no surer than they
    are themselves: a few may agree by chance."""

    def __init__(self) -> None:
        self._seen: list[OffsetEvidence] = []

    def add(self, evidence: OffsetEvidence) -> None:
        """Take note of one more keyframe."""
        self._seen = [*self._seen[1 - _MEMORY :], evidence]

    @property
    def estimate(self) -> OffsetEstimate | None:
        """None while there are too few keyframes."""
        return together(self._seen)


def together(seen: Sequence[OffsetEvidence]) -> OffsetEstimate | None:
    """What keyframes say with one another; None where there are too few."""
    n = len(seen)
    if n < _FEWEST:
        return None
    offsets = np.array([evidence.offset for evidence in seen])
    sigmas = np.hypot([evidence.sigma for evidence in seen], _SCATTER)
    off = np.abs(offsets - np.median(offsets)) / sigmas
    weights = 1 / (sigmas**2 * np.maximum(1.0, off / _OUTLIER))
    weights /= weights.sum()
    mean = float(weights @ offsets)
    scatter = np.sqrt(np.sum((weights * (offsets - mean)) ** 2) * n / (n - 1))
    own = np.sum([evidence.sigma**-2 for evidence in seen]) ** -0.5
    return OffsetEstimate(mean, float(np.hypot(max(scatter, own), SYSTEMATIC)))
