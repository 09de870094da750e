"""An inertial unit at the robot's origin: specific force and angular rate, means over time."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from gymnasium import spaces

from grouser.envs.sensors.base import Reading, Sensor
from grouser.envs.sensors.streams import Streams
from grouser.envs.simulation.motion import Motion
from grouser.envs.simulation.world import World
from grouser.geometry import Array

_FULL_SCALE = np.repeat([16 * 9.81, np.radians(2000)], 3)
"""(6,) m/s^2 and rad/s: beyond this a reading saturates, as the usual chips do."""


@dataclass(slots=True)
class _Memory:
    rng: np.random.Generator
    streams: Streams
    total: Array = field(default_factory=lambda: np.zeros(6))
    """(6,) sum of the ideal means of the control steps since the last reading."""
    steps: int = 0
    """How many these are."""
    walk: Array = field(default_factory=lambda: np.zeros(6))
    """(6,) the part of the biases that wanders."""


class InertialUnit(Sensor):
    """Specific force (+9.81 upwards at rest), then angular rate, both means since the last reading.

    Args:
        dt: length of a control step, s.
    """

    _memory: _Memory

    def __init__(self, *, dt: float) -> None:
        self._dt = dt

    @property
    def spaces(self) -> dict[str, spaces.Box]:
        return {"imu": spaces.Box(-_FULL_SCALE, _FULL_SCALE, dtype=np.float64)}

    def enter(self, world: World, rngs: Mapping[str, np.random.Generator]) -> None:
        self._memory = _Memory(rngs["imu"], Streams(rngs["imu"]))

    def advance(self, motion: Motion) -> None:
        memory = self._memory
        memory.total[:3] += motion.specific_force
        memory.total[3:] += motion.angular_rate
        memory.steps += 1

    def read(self, motion: Motion, amounts: Mapping[str, float]) -> Reading:
        memory = self._memory
        ideal = memory.total / memory.steps
        noise = _six(amounts, "noise") * memory.rng.standard_normal(6)
        self._wander(amounts)
        felt = ideal + noise + _six(amounts, "bias") + memory.walk
        memory.total, memory.steps = np.zeros(6), 0
        alive = 1 - amounts["imu.dead"]
        return {"imu": np.minimum(np.maximum(alive * felt, -_FULL_SCALE), _FULL_SCALE)}

    def _wander(self, amounts: Mapping[str, float]) -> None:
        """The biases' random walk since the last reading."""
        if amounts["imu.acceleration_walk"] or amounts["imu.rate_walk"]:
            density = _six(amounts, "walk")
            memory = self._memory
            elapsed = memory.steps * self._dt
            step = density * math.sqrt(elapsed) * memory.streams["walk"].standard_normal(6)
            memory.walk = memory.walk + step


def _six(amounts: Mapping[str, float], kind: str) -> Array:
    """(6,) an amount of the accelerations, thrice, and that of the rates, thrice."""
    a, w = amounts[f"imu.acceleration_{kind}"], amounts[f"imu.rate_{kind}"]
    return np.array([a, a, a, w, w, w])
