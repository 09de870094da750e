"""Tracks that run while the robot stands: the accelerometer feels it stop, the encoders do not.

A robot at a wall spins its tracks, and in the dark nothing contradicts them. But it lost its speed
within a few tenths of a second, which integrates to a clear sign before pitch and bias, which an
accelerometer cannot tell from acceleration, come to much.
"""

from collections import deque
from dataclasses import dataclass

import numpy as np

from grouser.estimators.base import Observation
from grouser.estimators.inclination import GRAVITY
from grouser.estimators.track_motion import reported_increments
from grouser.estimators.visual.prediction import Increment, MotionPredictor
from grouser.geometry import Array

_WINDOW, _BEFORE = 4, 10
"""Readings in which the speed is lost, and before, of which the accelerometer's mean is taken."""
_LOST = (0.6, 1.6)
"""Share of the tracks' speed that is lost: all of it, give or take a bounce and a pitching hull."""
_SLOWEST = 0.2
"""m/s of tracks: what slower ones lose, a bump in the ground may take as well"""
_STEADY = 0.3
"""Share by which the tracks' speed may change meanwhile"""


@dataclass(frozen=True, slots=True)
class _Felt:
    speed: float
    """m/s, of the tracks"""
    force: float
    """m/s^2 along x"""
    pitch_rate: float
    """rad/s"""


class StallWatch:
    """Whether the tracks spin on the spot: from a loss of speed that only the imu felt, until the
    tracks stop, reverse or slow down by half."""

    def __init__(self, dt: float) -> None:
        self._dt = dt
        self._felt: deque[_Felt] = deque(maxlen=_WINDOW + _BEFORE)
        self._stalled_at = 0.0
        self.stalled = False

    def watch(self, observation: Observation) -> None:
        """Take the next observation."""
        increments = reported_increments(observation)
        if increments is None:  # silent tracks are no sign of a stall
            self._felt.clear()
            return
        speed = float(increments.mean()) / self._dt
        imu = observation["imu"]
        self._felt.append(_Felt(speed, float(imu[0]), float(imu[4])))
        if self.stalled:
            self.stalled = speed / self._stalled_at > 0.5
        elif len(self._felt) == self._felt.maxlen and self._has_lost_its_speed():
            self.stalled, self._stalled_at = True, speed
            self._felt.clear()

    def _has_lost_its_speed(self) -> bool:
        felt = list(self._felt)
        speeds = np.array([one.speed for one in felt])
        before, now = speeds[:_BEFORE].mean(), speeds[_BEFORE:]
        if abs(before) < _SLOWEST or np.abs(now / before - 1).max() > _STEADY:
            return False
        forces = np.array([one.force for one in felt])
        gained = np.append(0.0, np.diff(speeds[:_BEFORE])) / self._dt
        usual = float(np.mean(forces[:_BEFORE] - gained))
        # Pitch, positive with the nose down, takes as much of gravity off as it grows.
        pitched = np.cumsum([one.pitch_rate for one in felt[_BEFORE:]]) * self._dt
        lost = -float(np.sum(forces[_BEFORE:] - usual + GRAVITY * pitched)) * self._dt
        return bool(_LOST[0] < lost / before < _LOST[1])


class StallingPredictor(MotionPredictor):
    """Predicts that the robot stands while its tracks stall; otherwise as another does.

    What is seen to move does not stall.
    """

    measures = True

    def __init__(self, inner: MotionPredictor, dt: float) -> None:
        self._inner, self._watch = inner, StallWatch(dt)
        self.errors = inner.errors
        self._by_tracks = 0.0

    def predict(self, observation: Observation, biases: Array) -> Increment:
        increment = self._inner.predict(observation, biases)
        self._by_tracks = float(np.hypot(*increment.pose[:2]))
        self._watch.watch(observation)
        if not self._watch.stalled:
            return increment
        slides = (_SLIDING * increment.pose) ** 2 + np.array([1e-3, 1e-3, 2e-3]) ** 2
        return Increment(np.zeros(3), np.diag(slides), np.zeros_like(increment.by_biases))

    def learn(self, increment: Array | None) -> None:
        if increment is not None and np.hypot(*increment[:2]) > self._by_tracks / 2:
            self._watch.stalled = False
        self._inner.learn(increment)

    def tell(self, biases: Array, covariance: Array) -> dict[str, float]:
        return self._inner.tell(biases, covariance) | {"stalled": float(self._watch.stalled)}


_SLIDING = 0.5
"""Share of what the tracks say that the robot still moves at a wall, in any direction."""
