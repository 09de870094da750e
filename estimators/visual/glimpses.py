"""What vision sees from frame to frame, whatever is made of it."""

from dataclasses import dataclass

import numpy as np

from grouser.estimators.visual.fusion import SLIP_GATE, RelativePose
from grouser.estimators.visual.prediction import Increment
from grouser.estimators.visual.sight import Expectation
from grouser.estimators.visual.single_pose import between, wrapped
from grouser.estimators.visual.stillness import contradicted
from grouser.geometry import Array

# m/s^2, rad/s^2: one sigma of how a robot is accelerated; four of it are more than ground can hold.
_ACCELERATION = np.array([1.5, 1.5, 4.0])


@dataclass(frozen=True, slots=True)
class _Step:
    """The motion over the last frame, as vision saw it."""

    pose: Array
    noise: Array
    """(3, 3)"""
    duration: float
    """s"""


class Glimpses:
    """Compares what is seen of a keyframe with what was seen of it a frame ago."""

    def __init__(self) -> None:
        self._before: _Step | None = None
        self._step: _Step | None = None
        self.start()

    def start(self) -> None:
        """The frame becomes a keyframe."""
        self.last = Expectation(np.zeros(3), np.zeros((3, 3)))

    def take(self, glimpse: RelativePose | None, duration: float) -> None:
        """What vision says of the way since the keyframe; None where it fails.

        Args:
            duration: since the frame before, s.
        """
        self._before, self._step = self._step, None
        if glimpse is None:
            return
        before, self.last = self.last, Expectation(glimpse.pose, glimpse.covariance)
        step = between(before.pose, glimpse.pose)
        self._step = _Step(step, before.covariance + glimpse.covariance, duration)

    def leaps(self, pose: Array, duration: float, *ways: Array) -> bool:
        """Whether a pose (3,), seen of the keyframe, is farther from the one before than a robot
        comes in so long [s] that moves as one of the ways (3,) does."""
        longest = max(float(np.hypot(way[0], way[1])) for way in ways)
        step = between(self.last.pose, pose)
        return bool(np.hypot(step[0], step[1]) > longest + 4 * _ACCELERATION[0] * duration**2)

    def stand(self, increment: Increment) -> bool:
        """Whether vision sees no motion since the last frame, and the tracks do.

        Total slip and a camera that shows the same again look alike; so does being carried.
        """
        return self._step is not None and contradicted(self._step.pose, self._step.noise, increment)

    def jump(self) -> bool:
        """Whether the motion is so much another than over the frame before that no robot with a
        mass made it, be its tracks on ice: then points were mistaken for others."""
        if self._step is None or self._before is None:
            return False
        if min(self._step.duration, self._before.duration) <= 0:
            return False  # stamps that tell no time
        # As far as the motion would have led in the time of this frame.
        share = self._step.duration / self._before.duration
        change = self._step.pose - share * self._before.pose
        change[2] = wrapped(change[2])
        between_middles = (self._step.duration + self._before.duration) / 2
        allowed = _ACCELERATION * between_middles * self._step.duration
        noise = self._step.noise + share**2 * self._before.noise + np.diag(allowed**2)
        return bool(change @ np.linalg.solve(noise, change) > SLIP_GATE)
