"""Tracks on slopes: what another predicts on level ground, laid on the ground as it is."""

from dataclasses import replace

import numpy as np

from grouser.estimators.base import Observation
from grouser.estimators.inclination import Inclination
from grouser.estimators.slope import SlopeOptions, on_slope, slip_covariance, unknown_covariance
from grouser.estimators.visual.constant_errors import ConstantErrors
from grouser.estimators.visual.prediction import Increment, MotionPredictor
from grouser.geometry import Array

_LEVEL = np.array([0.0, 0.0, 1.0])


class UnknownSlopePredictor(MotionPredictor):
    """With the creep and the slip of slopes that nothing tells."""

    measures = True

    def __init__(self, inner: MotionPredictor, width: float, options: SlopeOptions) -> None:
        """width: the effective one, m."""
        self._inner, self._width, self._options = inner, width, options
        self.errors = inner.errors

    def predict(self, observation: Observation, biases: Array) -> Increment:
        increment = self._inner.predict(observation, biases)
        if not increment.measured:  # a guess is uncertain enough
            return increment
        slip = unknown_covariance(float(increment.pose[2]), self._width, self._options)
        return replace(increment, covariance=increment.covariance + slip)

    def learn(self, increment: Array | None) -> None:
        self._inner.learn(increment)

    def tell(self, biases: Array, covariance: Array) -> dict[str, float]:
        return self._inner.tell(biases, covariance)


class SlopePredictor(MotionPredictor):
    """With the creep and the slip of the slope that an inertial unit tells.

    How far tracks creep, by the radian and along the way, are two more constant errors, which
    whatever corrects the pose tells.
    """

    measures = True

    def __init__(
        self,
        inner: MotionPredictor,
        inclination: Inclination,
        width: float,
        options: SlopeOptions,
    ) -> None:
        """
        Args:
            inner: predicts on level ground.
            inclination: is followed here; others may read it after `predict`.
            width: the effective one, m.
            options: how far tracks creep and slip.
        """
        self._inner, self._inclination, self._options = inner, inclination, options
        self._width = width
        self._vertical = inclination.vertical
        self._creep = np.array([options.creep_turning * width, options.creep_along])
        self._own = len(inner.errors)
        self.errors = inner.errors + ConstantErrors(
            ("creep in turns [m/rad]", "creep along"),
            np.array([options.creep_turning_sigma * width, options.creep_along_sigma]),
            np.array([options.creep_turning_walk * width, options.creep_along_walk]),
        )

    def predict(self, observation: Observation, biases: Array) -> Increment:
        level = self._inner.predict(observation, biases[: self._own])
        self._inclination.follow(observation, level.pose)
        before, self._vertical = self._vertical, self._inclination.vertical
        vertical = _between(before, self._vertical)
        creep = self._creep + biases[self._own :]
        increment = on_slope(level, _LEVEL if vertical is None else vertical, creep)
        if not level.measured:  # a guess is uncertain enough
            return increment
        slip = self._slip(level.pose, vertical, creep)
        return replace(increment, covariance=increment.covariance + slip)

    def learn(self, increment: Array | None) -> None:
        self._inner.learn(increment)

    def tell(self, biases: Array, covariance: Array) -> dict[str, float]:
        n = self._own
        return self._inner.tell(biases[:n], covariance[:n, :n]) | {
            "creep": float(self._creep[0] + biases[n]),
            "creep_sigma": float(np.sqrt(covariance[n, n])),
        }

    def _slip(self, moved: Array, vertical: Array | None, creep: Array) -> Array:
        """(3, 3) covariance, also of the creep by an error of the vertical."""
        way, turn = float(moved[0]), float(moved[2])
        if vertical is None:
            return unknown_covariance(turn, self._width, self._options)
        variance = self._inclination.sigma**2
        slope = float(vertical[:2] @ vertical[:2]) + 2 * variance
        slip = slip_covariance(turn, slope, self._inclination.tilted, self._width, self._options)
        slip[:2, :2] += np.eye(2) * variance * (creep[0] * abs(turn) + creep[1] * abs(way)) ** 2
        return slip


def _between(before: Array | None, after: Array | None) -> Array | None:
    """The vertical in the middle of a step; of its end alone where no more is known."""
    if before is None or after is None:
        return after
    middle = before + after
    return np.asarray(middle / np.linalg.norm(middle))
