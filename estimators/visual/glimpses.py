"""What vision sees from frame to frame, whatever is made of it."""

from dataclasses import dataclass

import numpy as np

from grouser.estimators.visual.fusion import SLIP_GATE, RelativePose
from grouser.estimators.visual.prediction import Increment
from grouser.estimators.visual.sight import Expectation
from grouser.estimators.visual.single_pose import between, compose, wrapped
from grouser.estimators.visual.stillness import contradicted
from grouser.geometry import Array, exp, log

_ACCELERATION = np.array([1.5, 1.5, 4.0])
"""m/s^2, rad/s^2: one sigma of how a robot is accelerated; four of it are more than ground can
hold"""
_AT_FIRST = np.array([1.5, 1.5, 1.5])
"""m/s, rad/s: one sigma of how it moves before anything is seen"""
_KEPT = 0.5
"""s for which a motion is expected to last that nothing measures"""


@dataclass(frozen=True, slots=True)
class _Step:
    """A motion, as vision saw it."""

    pose: Array
    noise: Array
    """(3, 3)"""
    duration: float
    """s"""


class Glimpses:
    """Compares what is seen of a keyframe with what was seen of it before."""

    def __init__(self) -> None:
        self._step: _Step | None = None
        self._sure_step = _Step(np.zeros(3), np.diag(_AT_FIRST**2), 1.0)
        """The last one that was believed, which ended so long ago [s]:"""
        self._since = 0.0
        self.start()

    def start(self) -> None:
        """The frame becomes a keyframe."""
        self.last = self._sure = Expectation(np.zeros(3), np.zeros((3, 3)))
        self._since_sure = 0.0  # s

    def take(self, glimpse: RelativePose | None, duration: float) -> None:
        """What vision says of the way since the keyframe; None where it fails.

        Args:
            duration: since the frame before, s.
        """
        self._step = None
        self._since += duration
        self._since_sure += duration
        if glimpse is not None:
            before, self.last = self.last, Expectation(glimpse.pose, glimpse.covariance)
            self._step = _step(before, self.last, duration)

    def believe(self, pose: Expectation) -> None:
        """What was seen last is right: the robot is here, as seen from the keyframe, and what is
        seen next is measured by that."""
        self._sure_step = _step(self._sure, pose, self._since_sure)
        self._sure, self._since_sure, self._since = pose, 0.0, 0.0

    def going_on(self) -> Array:
        """(3,) where the robot is, as seen from the keyframe, if it goes on as it went when it was
        last believed to be seen, for as long as its mass keeps its motion."""
        step, gap = self._sure_step, self._since - self._since_sure
        if step.duration <= 0:
            return self._sure.pose
        time = min(self._since_sure, max(_KEPT - gap, 0.0))
        return np.asarray(compose(self._sure.pose, exp(time / step.duration * log(step.pose))))

    def steadied(self, seen: RelativePose) -> RelativePose:
        """What is seen, and where a mass is that goes on as it went: together surer than either
        where all that is seen is far."""
        step = self._sure_step
        if step.duration <= 0:
            return seen
        expected = self.going_on()
        ahead = self._sure.covariance + _noise_of(step, self._since, self._since_sure)
        off = seen.pose - expected
        off[2] = wrapped(off[2])
        K = np.linalg.solve(ahead + seen.covariance, ahead).T
        covariance = seen.covariance @ K.T
        return RelativePose(
            expected + K @ off, (covariance + covariance.T) / 2, K @ seen.by_disparity
        )

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
        """Whether the motion is so much another than it was when it was last believed, that no
        robot with a mass made it, be its tracks on ice: then points were mistaken for others."""
        if self._step is None:
            return False
        now = _step(self._sure, self.last, self._since_sure)
        return _jumps(self._sure_step, now, self._since)


def _step(begin: Expectation, end: Expectation, duration: float) -> _Step:
    return _Step(between(begin.pose, end.pose), begin.covariance + end.covariance, duration)


def _jumps(before: _Step, step: _Step, since: float) -> bool:
    """Whether a step is no continuation of another, which ended so long ago [s]."""
    if min(step.duration, before.duration) <= 0:
        return False  # stamps that tell no time
    # As far as the motion would have led in the time of this step.
    share = step.duration / before.duration
    change = step.pose - share * before.pose
    change[2] = wrapped(change[2])
    noise = step.noise + _noise_of(before, since, step.duration)
    return bool(change @ np.linalg.solve(noise, change) > SLIP_GATE)


def _noise_of(before: _Step, since: float, duration: float) -> Array:
    """(3, 3) covariance of a motion that has gone on for so long [s] as over a step that ended
    `since` ago: by how well that was seen, and by what a mass may have gained meanwhile."""
    between_middles = since + (before.duration - duration) / 2
    gained = np.diag((_ACCELERATION * between_middles * duration) ** 2)
    return (duration / before.duration) ** 2 * before.noise + gained
