"""A planar lidar: exact ranges along slightly wrong bearings, then range noise."""

from collections.abc import Mapping

import numpy as np
from gymnasium import spaces

from grouser.envs.sensors.base import Reading, Sensor
from grouser.envs.simulation.motion import Motion
from grouser.envs.simulation.raycast import RayCaster
from grouser.envs.simulation.world import World
from grouser.rig import Lidar


class PlanarLidar(Sensor):
    """Ranges of all beams at the instant of the observation (a scan takes no time).

    A beam that meets nothing within `range_max` reads `range_max`, without noise; a reading is
    never below `range_min`.
    """

    def __init__(self, lidar: Lidar) -> None:
        self._lidar = lidar
        self._rng = np.random.default_rng(0)
        self._caster: RayCaster | None = None

    @property
    def spaces(self) -> dict[str, spaces.Box]:
        lidar = self._lidar
        shape = (lidar.n_beams,)
        return {"lidar": spaces.Box(lidar.range_min, lidar.range_max, shape, np.float32)}

    def enter(self, world: World, rngs: Mapping[str, np.random.Generator]) -> None:
        self._rng = rngs["lidar"]
        self._caster = RayCaster(world.solids)

    def read(self, motion: Motion) -> Reading:
        assert self._caster is not None, "enter() comes first"
        lidar = self._lidar
        bearing_noise, range_noise = self._rng.standard_normal((2, lidar.n_beams))
        bearing = lidar.bearings + lidar.sigma_bearing * bearing_noise
        beam = np.column_stack([np.cos(bearing), np.sin(bearing), np.zeros(lidar.n_beams)])
        T_world_lidar = motion.T_world_base @ lidar.T_base_lidar
        ideal = self._caster.cast(
            np.ascontiguousarray(T_world_lidar[:3, 3]),
            beam @ T_world_lidar[:3, :3].T,
            lidar.range_max,
        )
        noisy = np.where(
            ideal < lidar.range_max, ideal + lidar.sigma_range * range_noise, lidar.range_max
        )
        return {"lidar": np.clip(noisy, lidar.range_min, lidar.range_max).astype(np.float32)}
