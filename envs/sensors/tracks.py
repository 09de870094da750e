"""Track encoders: how far each track ran over its wheels, whatever the robot did."""

from collections.abc import Mapping

import numpy as np
from gymnasium import spaces

from grouser.envs.sensors.base import Reading, Sensor
from grouser.envs.simulation.motion import Motion
from grouser.envs.simulation.world import World


class TrackEncoders(Sensor):
    """Increments of the left and right track since the last observation.

    Args:
        limit: largest increment that can be read, m.
        noise: white noise of the scale, as a fraction of the increment (shoes stretch and skip).
        resolution: length of track between two encoder counts, m.
    """

    def __init__(self, *, limit: float, noise: float, resolution: float) -> None:
        if not 0 < resolution < np.inf:
            raise ValueError(f"track_resolution must be positive, got {resolution!r} m")
        self._limit, self._noise, self._resolution = limit, noise, resolution
        self._rng = np.random.default_rng(0)
        self._travelled, self._counted = np.zeros(2), np.zeros(2)

    @property
    def spaces(self) -> dict[str, spaces.Box]:
        return {"tracks": spaces.Box(-self._limit, self._limit, (2,), np.float64)}

    def enter(self, world: World, rngs: Mapping[str, np.random.Generator]) -> None:
        self._rng = rngs["tracks"]
        self._travelled, self._counted = np.zeros(2), np.zeros(2)

    def read(self, motion: Motion) -> Reading:
        scale = 1 + self._noise * self._rng.standard_normal(2)
        self._travelled = self._travelled + scale * motion.track_travel
        # Counts are of the whole way, so that what rounding keeps back comes with the next one.
        counted = np.floor(self._travelled / self._resolution + 0.5)
        increment = (counted - self._counted) * self._resolution
        self._counted = counted
        return {"tracks": np.clip(increment, -self._limit, self._limit)}
