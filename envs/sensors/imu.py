"""An inertial unit at the robot's origin: specific force and angular rate, means over time."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from gymnasium import spaces

from grouser.envs.sensors.base import Reading, Sensor
from grouser.envs.sensors.streams import Streams
from grouser.envs.simulation.motion import Motion
from grouser.envs.simulation.world import World
from grouser.geometry import Array
from grouser.kernels import kernel

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
        noise = memory.rng.standard_normal(6)
        self._wander(amounts)
        felt = np.empty(6)
        _feel(
            memory.total,
            memory.steps,
            memory.walk,
            noise,
            (amounts["imu.acceleration_noise"], amounts["imu.rate_noise"]),
            (amounts["imu.acceleration_bias"], amounts["imu.rate_bias"]),
            1 - amounts["imu.dead"],
            _FULL_SCALE,
            felt,
        )
        memory.total, memory.steps = np.zeros(6), 0
        return {"imu": felt}

    def _wander(self, amounts: Mapping[str, float]) -> None:
        """The biases' random walk since the last reading."""
        if amounts["imu.acceleration_walk"] or amounts["imu.rate_walk"]:
            a, w = amounts["imu.acceleration_walk"], amounts["imu.rate_walk"]
            density = np.repeat([a, w], 3)
            memory = self._memory
            elapsed = memory.steps * self._dt
            step = density * math.sqrt(elapsed) * memory.streams["walk"].standard_normal(6)
            memory.walk = memory.walk + step


@kernel
def _feel(
    total: Any,
    steps: int,
    walk: Any,
    noise: Any,
    sigma: Any,
    bias: Any,
    alive: float,
    full_scale: Any,
    felt: Any,
) -> None:
    """The mean of a total (6,) over steps with its errors: thrice an acceleration's, thrice a
    rate's sigma and bias."""
    for k in range(6):
        kind = 0 if k < 3 else 1
        value = total[k] / steps + sigma[kind] * noise[k] + bias[kind] + walk[k]
        felt[k] = min(max(alive * value, -full_scale[k]), full_scale[k])
