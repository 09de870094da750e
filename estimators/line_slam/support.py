"""How an estimate came about, told by what was seen and when."""

from grouser.checks import require_positive
from grouser.estimators.base import Observation, PoseEstimate, Status
from grouser.geometry import Array

_LOST = 0.35**2  # rad^2: the filter's Jacobians mean nothing beyond


class Support:
    """TRACKING for a while after a look that showed landmarks, then COASTING; LOST where the
    heading is known no more."""

    def __init__(self, lasts: float) -> None:
        """lasts: s that such a look counts for."""
        self.lasts = lasts
        require_positive(self, "lasts")
        self._until = float("-inf")

    def estimate(
        self,
        observation: Observation,
        pose: Array,
        covariance: Array,
        *,
        supported: bool,
        diagnostics: dict[str, float],
    ) -> PoseEstimate:
        """The estimate after an observation, of a pose (3,) with its covariance (3, 3)."""
        stamp = float(observation["stamp"][0])
        return PoseEstimate(
            pose=pose.copy(),
            covariance=covariance,
            status=self.status(supported, stamp, covariance),
            stamp=stamp,
            diagnostics=diagnostics,
        )

    def status(self, supported: bool, stamp: float, covariance: Array) -> Status:
        """After a step at `stamp` [s] that left the pose with a covariance (3, 3), and showed
        landmarks or did not."""
        if supported:
            self._until = stamp + self.lasts
        if covariance[2, 2] > _LOST:
            return Status.LOST
        return Status.TRACKING if stamp < self._until else Status.COASTING
