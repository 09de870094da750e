"""An inertial unit at the robot's origin: specific force and angular rate, means over a step."""

from collections.abc import Mapping

import numpy as np
from gymnasium import spaces

from grouser.envs.sensors.base import Reading, Sensor
from grouser.envs.simulation.motion import Motion
from grouser.envs.simulation.world import World
from grouser.rig import Imu

_FULL_SCALE = np.repeat([16 * 9.81, np.radians(2000)], 3)
"""(6,) m/s^2 and rad/s: beyond this a reading saturates, as the usual chips do."""


class InertialUnit(Sensor):
    """Specific force (+9.81 upwards at rest), then angular rate, both with white noise."""

    def __init__(self, imu: Imu) -> None:
        self._sigma = np.repeat([imu.sigma_acceleration, imu.sigma_rate], 3)
        self._rng = np.random.default_rng(0)

    @property
    def spaces(self) -> dict[str, spaces.Box]:
        return {"imu": spaces.Box(-_FULL_SCALE, _FULL_SCALE, dtype=np.float64)}

    def enter(self, world: World, rngs: Mapping[str, np.random.Generator]) -> None:
        self._rng = rngs["imu"]

    def read(self, motion: Motion) -> Reading:
        ideal = np.concatenate([motion.specific_force, motion.angular_rate])
        noisy = ideal + self._sigma * self._rng.standard_normal(6)
        return {"imu": np.clip(noisy, -_FULL_SCALE, _FULL_SCALE)}
