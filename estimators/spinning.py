"""A track that spins, at a rock or in mud: the gyroscope feels a turn that the tracks do not tell.

A track that goes so much less far than it says turns the robot by that over the width, and takes
half of it from the way. Where turns fall short because tracks slide sideways, nothing is taken.
"""

from dataclasses import replace

import numpy as np

from grouser.estimators.base import Observation
from grouser.estimators.gyro import Gyro
from grouser.estimators.track_motion import reported_increments
from grouser.estimators.visual.prediction import Increment, MotionPredictor
from grouser.geometry import Array

_SLIPS, _SPINS = 0.15, 0.5
"""Share of the faster track's increment that one of them lost, if one did: of slip, and of a spin
that no sliding explains."""
_LASTS = 25
"""Frames for which a spin lasts: what it takes adds up, and not its squares."""


class SpinningPredictor(MotionPredictor):
    """Doubts the way of another as far as a track may have spun."""

    measures = True

    def __init__(self, inner: MotionPredictor, gyro: Gyro, width: float) -> None:
        """
        Args:
            inner: predicts by the tracks.
            gyro: one of its own, about the axis upright on the tracks; it was reset.
            width: the effective one, m.
        """
        self._inner, self._gyro, self._width = inner, gyro, width
        self.errors = inner.errors
        self._told, self._faster = 0.0, 0.0
        """rad and m, since the gyroscope's last reading"""

    def predict(self, observation: Observation, biases: Array) -> Increment:
        increment = self._inner.predict(observation, biases)
        du = reported_increments(observation)
        self._told += float(increment.pose[2])
        self._faster += np.inf if du is None else float(np.abs(du).max())
        turned = self._gyro.read(observation)
        lost = 0.0 if turned is None else abs(turned.angle - self._told) * self._width
        along = np.diag([lost_way_variance(lost, self._faster), 0.0, 0.0])
        if self._gyro.fresh:
            self._told, self._faster = 0.0, 0.0
        return replace(increment, covariance=increment.covariance + along)

    def learn(self, increment: Array | None) -> None:
        self._inner.learn(increment)

    def tell(self, biases: Array, covariance: Array) -> dict[str, float]:
        return self._inner.tell(biases, covariance)


def lost_way_variance(lost: float, faster: float) -> float:
    """m^2, of a step's way.

    Args:
        lost: m, that one track went less far than it said, if it was one.
        faster: m, what the faster one said; inf where it said nothing.
    """
    if lost <= _SLIPS * faster:
        return 0.0
    return (lost / 2) ** 2 * (_LASTS if lost > _SPINS * faster else 1)
