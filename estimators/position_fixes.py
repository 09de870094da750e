"""Satellite fixes: which of them are new, and where the robot was when they were taken."""

from collections import deque
from dataclasses import dataclass

import numpy as np

from grouser.estimators.base import SAME_TIME, Observation, stamp_of
from grouser.geometry import Array
from grouser.rig import Gps

_MEMORY = 100
"""Poses that are remembered: a fix that is older than these is of no use."""


@dataclass(frozen=True, slots=True)
class Fix:
    """A new fix, carried on to now by what the robot has moved since it was taken."""

    position: Array
    """(2,) m, in the frame of the start"""
    age: float
    """s"""


class PositionFixes:
    """Takes every fix once.

    A fix that comes late is of a place in the past. It is shifted by the motion that was estimated
    since; the error of that is a few per cent of a few decimetres, and nothing beside a fix's own.
    """

    def __init__(self, gps: Gps) -> None:
        self.sigma = gps.sigma_position

    def reset(self, observation: Observation) -> None:
        """The first fix is not used: the start is known exactly."""
        self._taken_at = stamp_of("gps", observation)
        self._past: deque[tuple[float, Array]] = deque(maxlen=_MEMORY)
        self._past.append((float(observation["stamp"][0]), np.zeros(2)))

    def new(self, observation: Observation, position: Array) -> Fix | None:
        """The fix of an observation, unless there is none or it was given before.

        Args:
            position: (2,) estimated now, m.
        """
        now, taken_at = float(observation["stamp"][0]), stamp_of("gps", observation)
        self._past.append((now, position.copy()))
        if taken_at - self._taken_at < SAME_TIME:
            return None
        self._taken_at = taken_at
        fix = np.array(observation["gps"], dtype=np.float64)
        then = self._position_at(taken_at)
        if then is None or not np.isfinite(fix).all():
            return None
        return Fix(fix + position - then, now - taken_at)

    def _position_at(self, time: float) -> Array | None:
        """(2,) m; None before everything that is remembered."""
        stamps = np.array([stamp for stamp, _ in self._past])
        if time < stamps[0] - SAME_TIME:
            return None
        xy = np.array([position for _, position in self._past])
        return np.array([np.interp(time, stamps, xy[:, 0]), np.interp(time, stamps, xy[:, 1])])
