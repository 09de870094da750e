"""Vehicles without mass: they go exactly where their controls lead, and report those with noise."""

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from grouser.geometry import Array
from grouser.rig_motion import Steering

_TAIL = 10.0
"""Sigmas of noise that a space has room for; no draw is beyond them."""


@dataclass(frozen=True, slots=True, eq=False)
class Moved:
    """Where a vehicle is after a step, and how it came there."""

    pose: Array
    """(3,) in the world: x, y [m], heading [rad]."""
    twist: Array
    """(3,) forward, left [m/s] and yaw rate [rad/s] of the step."""
    controls: Array
    """(2,) what it was driven with, in the units in which the vehicle reports it, but true."""


def standing_at(pose: Array) -> Moved:
    """At rest, its wheels straight."""
    return Moved(pose.copy(), np.zeros(3), np.zeros(2))


class Vehicle(ABC):
    """How a vehicle follows its controls, and what it tells of them."""

    @property
    @abstractmethod
    def space(self) -> spaces.Box:
        """Of what it reports."""

    @abstractmethod
    def drive(self, before: Moved, action: Array) -> Moved:
        """One step with an action (2,) in [-1, 1]."""

    @abstractmethod
    def report(self, moved: Moved, rng: np.random.Generator) -> NDArray[np.float64]:
        """(2,) the controls of a step, noisy."""


class SteeredVehicle(Vehicle):
    """Paper 2, eq. (5): its origin is the front axle, whose wheel has the speed and the angle.

    The action is that speed and that angle as a fraction of their maximum; the wheel turns no
    faster than its largest rate. It reports speed [m/s] and angle [rad].
    """

    def __init__(self, steering: Steering, *, dt: float) -> None:
        self._s, self._dt = steering, dt
        self._sigmas = np.array([steering.sigma_speed, steering.sigma_angle])
        self._largest = np.array([steering.max_speed, steering.max_angle]) + _TAIL * self._sigmas

    @property
    def space(self) -> spaces.Box:
        return spaces.Box(-self._largest, self._largest, dtype=np.float64)

    def drive(self, before: Moved, action: Array) -> Moved:
        s, T = self._s, self._dt
        x, y, heading = before.pose.tolist()
        fraction, wanted = action.tolist()
        a = float(before.controls[1])
        turned = s.max_angle_rate * T
        a += min(max(wanted * s.max_angle - a, -turned), turned)
        V = fraction * s.max_speed
        yaw_rate = V * math.sin(a) / s.wheelbase
        x += T * V * math.cos(heading + a)  # eq. (5)
        y += T * V * math.sin(heading + a)
        heading = _wrapped(heading + T * yaw_rate)
        twist = np.array([V * math.cos(a), V * math.sin(a), yaw_rate])
        return Moved(np.array([x, y, heading]), twist, np.array([V, a]))

    def report(self, moved: Moved, rng: np.random.Generator) -> NDArray[np.float64]:
        told = moved.controls + self._sigmas * rng.standard_normal(2)
        return np.asarray(np.minimum(np.maximum(told, -self._largest), self._largest))


class TrackedVehicle(Vehicle):
    """Two tracks that do not slip: exact arcs about its origin, midway between them.

    The action is each track's speed as a fraction of the top speed; it reports how far each ran
    in the step [m], off by white noise that is a share of it.

    Args:
        width: between the tracks, as they turn the vehicle, m.
        top_speed: of a track, m/s.
        noise: standard deviation of a reported increment, over the increment.
        dt: length of a step, s.
    """

    def __init__(self, *, width: float, top_speed: float, noise: float, dt: float) -> None:
        self._width, self._top_speed, self._noise, self._dt = width, top_speed, noise, dt
        self._largest = top_speed * dt * (1 + _TAIL * noise)

    @property
    def space(self) -> spaces.Box:
        return spaces.Box(-self._largest, self._largest, (2,), dtype=np.float64)

    def drive(self, before: Moved, action: Array) -> Moved:
        left, right = (self._top_speed * self._dt * action).tolist()
        turn, way = (right - left) / self._width, (left + right) / 2
        x, y, heading = before.pose.tolist()
        half = turn / 2
        chord = way * (math.sin(half) / half if half else 1.0)
        x += chord * math.cos(heading + half)
        y += chord * math.sin(heading + half)
        pose = np.array([x, y, _wrapped(heading + turn)])
        twist = np.array([way / self._dt, 0.0, turn / self._dt])
        return Moved(pose, twist, np.array([left, right]))

    def report(self, moved: Moved, rng: np.random.Generator) -> NDArray[np.float64]:
        told = moved.controls * (1 + self._noise * rng.standard_normal(2))
        return np.asarray(np.minimum(np.maximum(told, -self._largest), self._largest))


def _wrapped(angle: float) -> float:
    """rad, in (-pi, pi]; `geometry.wrap` for one number, faster."""
    turned = math.remainder(angle, 2 * math.pi)
    return turned if turned > -math.pi else math.pi
