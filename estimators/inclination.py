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
from grouser.estimators.base import SAME_TIME, Observation, stamp_of
from grouser.geometry import Array
from grouser.kernels import kernel
from grouser.rig import Imu

GRAVITY = 9.81
"""m/s^2"""

_FLAT = 1e-2
_SCALE = 0.01
"""Of a turn, that the gyroscope may be off beside its noise"""
_USUAL = 4.0
"""Squared residual over its covariance, of two degrees of freedom, that is no shock"""
_UNSEEN = 0.5
"""rad/s, that a robot may tilt while its unit is dead"""


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
        self._shown_at = float(observation["stamp"][0])
        self._way = self._driven_for = self._speed = 0.0
        self.tilted = 0.0
        """rad, by which the robot tilted since the last reading: it turned so far about x and y."""

    @property
    def sigma(self) -> float:
        """rad, of the vertical about its worse axis; inf where nothing tells it now."""
        if self._late:
            return math.inf
        return math.sqrt(max(self._P[0, 0], self._P[1, 1]))

    @property
    def vertical(self) -> Array | None:
        """(3,) up, as the robot sees it; None where that is unknown."""
        return None if self.sigma > self._options.unknown_above else self._vertical()

    @property
    def levelling(self) -> Array | None:
        """(3, 3) R: a vector v of the robot's frame is R v in the level frame that heads the same
        way; None where the vertical is unknown."""
        vertical = self.vertical
        return None if vertical is None else levelling(vertical)

    @property
    def bias(self) -> Array:
        """(2,) of the gyroscope about x and y, rad/s."""
        return self._mean[2:].copy()

    def follow(self, observation: Observation, increment: Array | None) -> None:
        """Take the next observation.

        Args:
            increment: (3,) how the robot moved since the last one, as far as is known.
        """
        read_at, now = stamp_of("imu", observation), float(observation["stamp"][0])
        duration = read_at - self._read_at
        imu = np.asarray(observation["imu"], dtype=np.float64)
        self._late = now - read_at > max(duration, SAME_TIME) / 2
        self.tilted = 0.0
        if increment is not None:
            self._way += float(increment[0])
            self._driven_for += now - self._shown_at
        self._shown_at = now
        if duration <= SAME_TIME:
            return
        self._read_at = read_at
        if not imu.any() or not np.isfinite(imu).all():  # a dead one, for gravity is always there
            self._P[:2, :2] += np.eye(2) * (_UNSEEN * duration) ** 2
            return
        self.tilted = float(np.hypot(*(imu[3:5] - self._mean[2:]))) * duration
        ahead, across = self._acceleration(float(imu[5]), duration)
        options, sigma = self._options, self._imu
        _turn(self._mean, self._P, imu, duration, sigma.sigma_rate, options.bias_walk)
        _feel(
            self._mean,
            self._P,
            (float(imu[0]) - ahead) / GRAVITY,
            (float(imu[1]) - across) / GRAVITY,
            math.sqrt(float(imu[0] ** 2 + imu[1] ** 2 + imu[2] ** 2)) / GRAVITY - 1,
            (sigma.sigma_acceleration**2 + options.acceleration**2) / GRAVITY**2,
        )

    def _vertical(self) -> Array:
        x, y = self._mean[:2].tolist()
        return np.array([x, y, math.sqrt(max(1 - x * x - y * y, _FLAT))])

    def _acceleration(self, turn_rate: float, dt: float) -> tuple[float, float]:
        """Of the robot since the last reading, dt [s] ago, ahead and across, m/s^2: by how its
        speed changed since the reading before, and by how it turns."""
        before = self._speed
        if self._driven_for > SAME_TIME:
            self._speed = self._way / self._driven_for
        self._way = self._driven_for = 0.0
        return (self._speed - before) / dt, self._speed * turn_rate


@kernel
def _turn(
    mean: Array, P: Array, imu: Array, dt: float, sigma_rate: float, bias_walk: float
) -> None:
    """By the mean rate of the time dt [s], in place."""
    x, y = mean[0], mean[1]
    z = math.sqrt(max(1 - x * x - y * y, _FLAT))
    wx, wy = imu[3] - mean[2], imu[4] - mean[3]
    c, s = math.cos(imu[5] * dt), math.sin(imu[5] * dt)
    x, y = x - wy * z * dt, y + wx * z * dt
    mean[0], mean[1] = c * x + s * y, c * y - s * x
    F = np.eye(4)
    F[0, 0], F[0, 1], F[1, 0], F[1, 1] = c, s, -s, c
    F[0, 2], F[0, 3], F[1, 2], F[1, 3] = -s * dt, c * dt, -c * dt, -s * dt
    moved = F @ P @ F.T
    white = (sigma_rate * dt) ** 2 + (_SCALE * dt) ** 2 * (wx * wx + wy * wy)
    for i in range(4):
        for j in range(4):
            P[i, j] = moved[i, j]
        P[i, i] += white if i < 2 else bias_walk * bias_walk * dt


@kernel
def _feel(mean: Array, P: Array, x: float, y: float, shock: float, variance: float) -> None:
    """Correct by the vertical (x, y) that the force tells, in place.

    Args:
        shock: how far the force is off gravity, as a share of it: a bump shakes all axes, so that
            this says how little to believe it.
    """
    e0, e1 = x - mean[0], y - mean[1]
    variance += shock * shock
    a, b, d = P[0, 0] + variance, P[0, 1], P[1, 1] + variance
    off = (d * e0 * e0 - 2 * b * e0 * e1 + a * e1 * e1) / (a * d - b * b)
    if off > _USUAL:
        more = variance * (off / _USUAL - 1)
        a, d = a + more, d + more
    determinant = a * d - b * b
    K = np.empty((4, 2))
    for i in range(4):
        K[i, 0] = (d * P[i, 0] - b * P[i, 1]) / determinant
        K[i, 1] = (a * P[i, 1] - b * P[i, 0]) / determinant
    old = P.copy()
    for i in range(4):
        mean[i] += K[i, 0] * e0 + K[i, 1] * e1
        for j in range(4):
            P[i, j] = old[i, j] - K[i, 0] * old[0, j] - K[i, 1] * old[1, j]


def levelling(vertical: Array) -> Array:
    """(3, 3) R whose rows are, in a frame that sees the vertical as (3,), the axes of the level one
    that heads the same way."""
    u, v, w = vertical.tolist()
    reach = math.sqrt(1 - u * u)
    x, y, z = reach, -u * v / reach, -u * w / reach
    return np.array([[x, y, z], [v * z - w * y, w * x - u * z, u * y - v * x], [u, v, w]])
