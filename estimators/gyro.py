"""What the gyroscope says of the turn since its last reading."""

import math
from dataclasses import dataclass

import numpy as np

from grouser.checks import require_not_negative
from grouser.estimators.base import SAME_TIME, Observation, stamp_of
from grouser.estimators.inclination import Inclination
from grouser.estimators.visual.constant_errors import ConstantErrors
from grouser.geometry import Array
from grouser.rig import Imu


@dataclass(frozen=True, slots=True)
class GyroOptions:
    """What is wrong with a gyroscope beside the white noise that the rig states."""

    bias_sigma: float = 0.005
    """Of its bias at the start, rad/s."""
    bias_walk: float = 1e-4
    """How far that wanders, rad/s per square root of a s."""
    turn_share: float = 0.003
    """White noise as a share of the turn: scale, and axes that are not quite upright."""

    def __post_init__(self) -> None:
        require_not_negative(self, "bias_sigma", "bias_walk", "turn_share")


@dataclass(frozen=True, slots=True)
class Turn:
    """The turn between two readings."""

    angle: float
    """rad"""
    variance: float
    """rad^2"""
    duration: float
    """s; the error per rad/s of bias"""


class Gyro:
    """Reads the angular rate about the robot's z axis, which is the mean since the last reading.

    Where the inclination is told, the turn is that of the heading, about the vertical: on a slope a
    robot that rolls and pitches as it turns has a share of it about its other axes.
    """

    def __init__(
        self, imu: Imu, dt: float, options: GyroOptions, inclination: Inclination | None = None
    ) -> None:
        """
        Args:
            dt: between two observations, s.
            inclination: is read here; who follows it has done so with the same observation.
        """
        self._sigma = imu.sigma_rate
        self._inclination = inclination
        self._turn_share = options.turn_share
        walk = options.bias_walk * math.sqrt(dt)
        self.errors = ConstantErrors(
            ("gyroscope's bias [rad/s]",), np.array([options.bias_sigma]), np.array([walk])
        )

    def reset(self, observation: Observation) -> None:
        """Start with the first observation, whose reading is of the time before it."""
        self._read_at = stamp_of("imu", observation)
        self._up = None if self._inclination is None else self._inclination.vertical
        self.fresh = True

    def read(self, observation: Observation) -> Turn | None:
        """The turn since the last reading; None without a new one, or with one of the past.

        `fresh` then says whether there was a new one. A sensor that is dead reads six zeros, which
        gravity forbids. One that is late says nothing of the motion up to now.
        """
        imu = np.asarray(observation["imu"], dtype=np.float64)
        read_at, now = stamp_of("imu", observation), float(observation["stamp"][0])
        duration = read_at - self._read_at
        self.fresh = duration > SAME_TIME
        if not self.fresh:
            return None
        self._read_at = read_at
        if now - read_at > SAME_TIME or not imu.any() or not np.isfinite(imu[5]):
            return None
        rate, variance = self._heading_rate(imu[3:])
        angle = rate * duration
        variance = variance * duration**2 + (self._turn_share * angle) ** 2
        return Turn(angle, variance, duration)

    def _heading_rate(self, rates: Array) -> tuple[float, float]:
        """rad/s about the vertical, where that is known, and its variance."""
        about_z, variance = float(rates[2]), self._sigma**2
        before, up = self._up, None if self._inclination is None else self._inclination.vertical
        self._up = up
        if self._inclination is None or up is None or not np.isfinite(rates[:2]).all():
            return about_z, variance
        u, v, w = (up if before is None else (before + up) / 2).tolist()
        about_x, about_y = (rates[:2] - self._inclination.bias).tolist()
        # A step's end tells the vertical no better than its sigma, and that tilts the rates.
        tilted = self._inclination.sigma**2 * (about_y**2 + (v * about_z) ** 2)
        flat = 1 - u * u
        return (about_y * v + about_z * w) / flat, variance / flat + tilted
