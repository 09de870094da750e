"""A satellite receiver at the robot's origin: where it is in the frame of its start."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from gymnasium import spaces

from grouser.envs.sensors.base import Reading, Sensor
from grouser.envs.sensors.streams import Streams
from grouser.envs.sensors.wandering import Wandering
from grouser.envs.simulation.motion import Motion
from grouser.envs.simulation.world import World
from grouser.geometry import Array, inverse_transform

_FARTHEST = 1e5
"""m: a bound only because spaces must have one."""
_DRIFT_TIME = 60.0
"""Correlation time of the drift, s: satellites and the air's layers change slowly."""


@dataclass(slots=True)
class _Memory:
    rng: np.random.Generator
    streams: Streams
    T_start_world: Array | None = None
    """(4, 4); None before the first motion."""
    steps: int = 0
    """Control steps since the last reading."""
    drift: Wandering | None = None
    """None before the first that there is."""
    jump: Array | None = None
    """(2,) unit vector of this episode's jumps; None before the first."""


class FixSpace(spaces.Box):
    """Positions (2,) in m, or NaN where there is no fix."""

    def __init__(self) -> None:
        super().__init__(-_FARTHEST, _FARTHEST, (2,), np.float64)

    def contains(self, x: object) -> bool:
        """Whether x is a position or NaN."""
        if isinstance(x, np.ndarray) and x.shape == self.shape and np.isnan(x).all():
            return bool(x.dtype == self.dtype)
        return bool(super().contains(x))


class SatelliteReceiver(Sensor):
    """Position fixes in the frame of the start, with white noise and a slow drift.

    Args:
        dt: length of a control step, s.
    """

    _memory: _Memory

    def __init__(self, *, dt: float) -> None:
        self._dt = dt

    @property
    def spaces(self) -> dict[str, spaces.Box]:
        return {"gps": FixSpace()}

    def enter(self, world: World, rngs: Mapping[str, np.random.Generator]) -> None:
        self._memory = _Memory(rngs["gps"], Streams(rngs["gps"]))

    def advance(self, motion: Motion) -> None:
        memory = self._memory
        memory.steps += 1
        if memory.T_start_world is None:
            memory.T_start_world = inverse_transform(motion.T_world_base)

    def read(self, motion: Motion, amounts: Mapping[str, float]) -> Reading:
        memory = self._memory
        assert memory.T_start_world is not None, "advance() comes first"
        ideal = (memory.T_start_world @ motion.T_world_base)[:2, 3]
        noise = amounts["gps.noise"] * memory.rng.standard_normal(2)
        fix = ideal + noise + self._drift(amounts["gps.drift"]) + self._jump(amounts["gps.jump"])
        if amounts["gps.outage"]:
            fix = np.full(2, np.nan)
        return {"gps": np.clip(fix, -_FARTHEST, _FARTHEST)}

    def _drift(self, sigma: float) -> Array:
        """(2,) m."""
        memory = self._memory
        elapsed, memory.steps = memory.steps * self._dt, 0
        if sigma == 0:
            return np.zeros(2)
        if memory.drift is None:
            rng = memory.streams["drift"]
            memory.drift = Wandering(2, correlation_time=_DRIFT_TIME, rng=rng)
        return sigma * memory.drift.after(elapsed)

    def _jump(self, size: float) -> Array:
        """(2,) m."""
        memory = self._memory
        if size == 0:
            return np.zeros(2)
        if memory.jump is None:
            angle = memory.streams["jump"].uniform(-np.pi, np.pi)
            memory.jump = np.array([np.cos(angle), np.sin(angle)])
        return size * memory.jump
