"""An estimate takes time to work out: it arrives late, in simulated time."""

from collections import deque

from grouser.estimators.base import PoseEstimate

_TOLERANCE = 1e-9  # s; stamps are multiples of a step that is no binary fraction


class PoseDelay:
    """Holds each estimate back until its latency has passed.

    The first one is known at once: that the robot starts at pose zero needs no working out.
    """

    def __init__(self, latency: float) -> None:
        """
        Args:
            latency: between an estimate's stamp and its arrival, s.

        Raises:
            ValueError: the latency is negative or not finite.
        """
        if not 0 <= latency < float("inf"):
            raise ValueError(f"pose_latency must be 0 s or more, and finite, got {latency!r}")
        self._latency = latency
        self._under_way: deque[PoseEstimate] = deque()

    def reset(self, first: PoseEstimate) -> PoseEstimate:
        """Start an episode; the first estimate."""
        self._under_way.clear()
        self._arrived = first
        return first

    def arrived(self, newest: PoseEstimate, time: float) -> PoseEstimate:
        """The last estimate that has arrived by a time [s], the newest being under way too."""
        self._under_way.append(newest)
        while self._under_way and self._is_due(self._under_way[0], time):
            self._arrived = self._under_way.popleft()
        return self._arrived

    def _is_due(self, estimate: PoseEstimate, time: float) -> bool:
        return estimate.stamp + self._latency <= time + _TOLERANCE
