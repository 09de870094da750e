"""Track encoders: how far each track ran over its wheels, whatever the robot did."""

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


@dataclass(slots=True)
class _Memory:
    rng: np.random.Generator
    streams: Streams
    since_reading: Array = field(default_factory=lambda: np.zeros(2))
    """(2,) how far each track ran since the last reading, m."""
    felt: Array = field(default_factory=lambda: np.zeros(2))
    """(2,) how far the encoders' wheels turned since the start, m."""


class TrackEncoders(Sensor):
    """Increments of the left and right track since the last reading.

    Args:
        limit: largest increment that can be read, m.
    """

    adds_up = True
    _memory: _Memory

    def __init__(self, *, limit: float) -> None:
        self._limit = limit

    @property
    def spaces(self) -> dict[str, spaces.Box]:
        return {"tracks": spaces.Box(-self._limit, self._limit, (2,), np.float64)}

    def enter(self, world: World, rngs: Mapping[str, np.random.Generator]) -> None:
        self._memory = _Memory(rngs["tracks"], Streams(rngs["tracks"]))

    def advance(self, motion: Motion) -> None:
        memory = self._memory
        memory.since_reading = memory.since_reading + motion.track_travel

    def read(self, motion: Motion, amounts: Mapping[str, float]) -> Reading:
        memory, resolution = self._memory, amounts["tracks.resolution"]
        # Ticks are of the whole way, so that what rounding keeps back comes with the next reading.
        felt, ticks = np.empty(2), np.empty(2)
        _count(
            memory.felt,
            memory.since_reading,
            amounts["tracks.noise"],
            memory.rng.standard_normal(2),
            (1 + amounts["tracks.left_scale"]) * (1 - amounts["tracks.left_stuck"]),
            (1 + amounts["tracks.right_scale"]) * (1 - amounts["tracks.right_stuck"]),
            resolution,
            felt,
            ticks,
        )
        memory.felt, memory.since_reading = felt, np.zeros(2)
        if amounts["tracks.missed_ticks"] > 0:
            ticks -= self._missed(ticks, amounts["tracks.missed_ticks"])
        read = np.minimum(np.maximum(ticks * resolution, -self._limit), self._limit)
        return {"tracks": read}

    def _missed(self, ticks: Array, probability: float) -> Array:
        """(2,) how many of the ticks were not counted, with their sign."""
        rng = self._memory.streams["missed_ticks"]
        return np.asarray(np.sign(ticks) * rng.binomial(np.abs(ticks).astype(int), probability))


@kernel
def _count(
    before: Any,
    increment: Any,
    sigma: float,
    noise: Any,
    left: float,
    right: float,
    resolution: float,
    felt: Any,
    ticks: Any,
) -> None:
    """What both encoders have felt after an increment (2,) [m], each with its gain and the noise of
    shoes that stretch and skip, and how many ticks were added by it."""
    for side in range(2):
        gain = left if side == 0 else right
        felt[side] = before[side] + gain * (1 + sigma * noise[side]) * increment[side]
        ticks[side] = math.floor(felt[side] / resolution + 0.5) - math.floor(
            before[side] / resolution + 0.5
        )
