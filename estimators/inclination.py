"""Which way is up in the robot's frame, by gyroscope and accelerometer.

A Kalman filter of the vertical u (3,), as the robot sees it. It turns against the robot, du/dt =
-w x u, at the rate that the gyroscope tells but for its bias; an accelerometer tells g u and what
the robot accelerates (Mahony, Hamel and Pflimlin, "Nonlinear complementary filters on the special
orthogonal group", IEEE TAC 53, 2008, with a gain by covariance). The motion that is known is taken
off; what is left of shocks and slip counts the less, the larger it is.
"""

import math
from dataclasses import dataclass

import numpy as np

from grouser.checks import require_not_negative, require_positive
from grouser.estimators.base import Observation, stamp_of
from grouser.geometry import Array
from grouser.rig import Imu

GRAVITY = 9.81
"""m/s^2"""


@dataclass(frozen=True, slots=True)
class InclinationOptions:
    """What an inertial unit's noise, as the rig states it, leaves out."""

    bias_sigma: float = 0.005
    """Of the gyroscope's bias at the start, rad/s."""
    bias_walk: float = 1e-4
    """How far that wanders, rad/s per square root of a s."""
    acceleration: float = 0.15
    """One sigma of an acceleration that the motion does not tell, m/s^2."""
    start_sigma: float = 0.02
    """Of the first reading's vertical, rad."""
    unknown_above: float = 0.03
    """rad, one sigma from which on the vertical counts as unknown."""

    def __post_init__(self) -> None:
        require_not_negative(self, "bias_sigma", "bias_walk")
        require_positive(self, "acceleration", "start_sigma", "unknown_above")


class Inclination:
    """Follows the vertical from reading to reading."""

    def __init__(
        self, imu: Imu, observation: Observation, options: InclinationOptions | None = None
    ) -> None:
        """observation: the first one, whose reading is of a robot that hardly accelerates."""
        self._imu, self._options = imu, options or InclinationOptions()
        force = np.asarray(observation["imu"], dtype=np.float64)[:3]
        known = 0.5 * GRAVITY < float(np.linalg.norm(force)) < 2 * GRAVITY
        self._mean = (
            np.array([*(force[:2] / np.linalg.norm(force)), 0.0, 0.0]) if known else np.zeros(4)
        )
        """u_x, u_y, and the gyroscope's bias about x and y, rad/s"""
        start = self._options.start_sigma if known else 1.0
        self._P = np.diag([start, start, self._options.bias_sigma, self._options.bias_sigma]) ** 2
        self._read_at = stamp_of("imu", observation)
        self._late = False
        self._speed = 0.0

    @property
    def sigma(self) -> float:
        """rad, of the vertical about its worse axis; inf where nothing tells it now."""
        if self._late:
            return math.inf
        return math.sqrt(max(self._P[0, 0], self._P[1, 1]))

    @property
    def levelling(self) -> Array | None:
        """(3, 3) R: a vector v of the robot's frame is R v in the level frame that heads the same
        way; None where the vertical is unknown."""
        if self.sigma > self._options.unknown_above:
            return None
        return levelling(self._vertical())

    def follow(self, observation: Observation, increment: Array | None) -> None:
        """Take the next observation.

        Args:
            increment: (3,) how the robot moved since the last one, as far as is known.
        """
        read_at, now = stamp_of("imu", observation), float(observation["stamp"][0])
        duration = read_at - self._read_at
        imu = np.asarray(observation["imu"], dtype=np.float64)
        self._late = now - read_at > max(duration, _ROUNDING) / 2
        if duration <= _ROUNDING:
            return
        self._read_at = read_at
        if not imu.any() or not np.isfinite(imu).all():  # a dead one, for gravity is always there
            self._P[:2, :2] += np.eye(2) * (_UNSEEN * duration) ** 2
            return
        self._turn(imu[3:], duration)
        self._feel(imu[:3], self._acceleration(increment, imu[5], duration))

    def _vertical(self) -> Array:
        x, y = self._mean[:2].tolist()
        return np.array([x, y, math.sqrt(max(1 - x * x - y * y, _FLAT))])

    def _turn(self, rate: Array, dt: float) -> None:
        """By the mean rate (3,) [rad/s] of the time dt [s]."""
        options = self._options
        x, y, z = self._vertical().tolist()
        wx, wy = rate[0] - self._mean[2], rate[1] - self._mean[3]
        c, s = math.cos(rate[2] * dt), math.sin(rate[2] * dt)
        x, y = x - wy * z * dt, y + wx * z * dt
        self._mean[:2] = c * x + s * y, c * y - s * x
        F = np.eye(4)
        F[:2, :2] = [[c, s], [-s, c]]
        F[:2, 2:] = np.array([[-s, c], [-c, -s]]) * dt
        self._P = F @ self._P @ F.T
        white = (self._imu.sigma_rate * dt) ** 2 + (_SCALE * float(np.hypot(wx, wy)) * dt) ** 2
        walk = options.bias_walk**2 * dt
        self._P[range(4), range(4)] += [white, white, walk, walk]

    def _feel(self, force: Array, acceleration: Array) -> None:
        """Correct by a specific force (3,), of which the robot accelerates by (2,) [m/s^2]."""
        residual = (force[:2] - acceleration) / GRAVITY - self._mean[:2]
        variance = (self._imu.sigma_acceleration**2 + self._options.acceleration**2) / GRAVITY**2
        shock = (float(np.linalg.norm(force)) - GRAVITY) / GRAVITY
        # A bump shakes all axes: how far the force is off gravity says how little to believe it.
        variance += shock * shock
        S = self._P[:2, :2] + variance * np.eye(2)
        off = float(residual @ np.linalg.solve(S, residual))
        if off > _USUAL:
            S = S + variance * (off / _USUAL - 1) * np.eye(2)
        K = np.linalg.solve(S, self._P[:2]).T
        self._mean = self._mean + K @ residual
        self._P = self._P - K @ S @ K.T
        self._P = (self._P + self._P.T) / 2

    def _acceleration(self, increment: Array | None, turn_rate: float, dt: float) -> Array:
        """(2,) of the robot, by its speed and by how it turns."""
        before = self._speed
        self._speed = before if increment is None else float(increment[0]) / dt
        return np.array([(self._speed - before) / dt, self._speed * turn_rate])


def levelling(vertical: Array) -> Array:
    """(3, 3) R whose rows are, in a frame that sees the vertical as (3,), the axes of the level one
    that heads the same way."""
    ahead = np.array([1.0, 0.0, 0.0]) - vertical[0] * vertical
    ahead /= np.linalg.norm(ahead)
    x, y, z = ahead.tolist()
    u, v, w = vertical.tolist()
    return np.array([[x, y, z], [v * z - w * y, w * x - u * z, u * y - v * x], [u, v, w]])


_ROUNDING = 1e-6
"""s: stamps closer than this are the same time"""
_FLAT = 1e-2
_SCALE = 0.01
"""Of a turn, that the gyroscope may be off beside its noise"""
_USUAL = 4.0
"""Squared residual over its covariance, of two degrees of freedom, that is no shock"""
_UNSEEN = 0.5
"""rad/s, that a robot may tilt while its unit is dead"""
