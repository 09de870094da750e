"""A planar lidar: exact ranges along slightly wrong bearings, then range noise, then faults."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from grouser.envs.sensors.base import Reading, Sensor
from grouser.envs.sensors.streams import Streams
from grouser.envs.simulation.motion import Motion
from grouser.envs.simulation.raycast import RayCaster
from grouser.envs.simulation.world import Boxes, Cylinders, World
from grouser.geometry import Array
from grouser.kernels import kernel
from grouser.rig import Lidar

_SWEEP_POSES = 9
"""Poses taken from a motion during a scan; between them they are interpolated linearly."""


@dataclass(slots=True)
class _Memory:
    rng: np.random.Generator
    streams: Streams
    opacity: Array
    """(solids + cylinders,) uniform in [0, 1): what is below the share of glass is glass."""


class PlanarLidar(Sensor):
    """Ranges of all beams, at the instant of the reading unless a scan takes time.

    A beam that meets nothing within `range_max` reads `range_max`, without noise; a reading is
    never below `range_min`.
    """

    _memory: _Memory

    def __init__(self, lidar: Lidar) -> None:
        self._lidar, self._bearings = lidar, lidar.bearings
        self._all = np.ones(lidar.n_beams, dtype=np.bool_)
        self._world: World | None = None
        self._casters: dict[float, RayCaster] = {}

    @property
    def spaces(self) -> dict[str, spaces.Box]:
        lidar = self._lidar
        shape = (lidar.n_beams,)
        return {"lidar": spaces.Box(lidar.range_min, lidar.range_max, shape, np.float32)}

    def enter(self, world: World, rngs: Mapping[str, np.random.Generator]) -> None:
        streams = Streams(rngs["lidar"])
        opacity = streams["glass"].random(len(world.solids) + len(world.cylinders))
        self._memory = _Memory(rngs["lidar"], streams, opacity)
        self._world, self._casters = world, {}

    def restore(self, saved: bytes) -> None:
        super().restore(saved)
        self._casters = {}

    def read(self, motion: Motion, amounts: Mapping[str, float]) -> Reading:
        lidar = self._lidar
        bearing_noise, range_noise = self._memory.rng.standard_normal((2, lidar.n_beams))
        bearings = self._bearings + amounts["lidar.bearing_noise"] * bearing_noise
        told = np.empty(lidar.n_beams, dtype=np.float32)
        _tell(
            self._spread_range(motion, bearings, amounts),
            amounts["lidar.range_noise"],
            range_noise,
            self._kept(amounts["lidar.dropout"]),
            amounts["lidar.quantisation"],
            (1 - amounts["lidar.range_loss"]) * lidar.range_max,
            lidar.range_min,
            lidar.range_max,
            told,
        )
        return {"lidar": told}

    def _spread_range(self, motion: Motion, bearings: Array, amounts: Mapping[str, float]) -> Array:
        """(n,) m: a beam that is `mixed_pixels` wide to either side mixes what it meets there.

        The nearest and the farthest return of a beam share its light by chance; what lets light
        through to nothing returns only what is near (Tang, Huber and Akinci, ISPRS J. 62, 2007).
        """
        centre = self._range(motion, bearings, amounts)
        half_width = amounts["lidar.mixed_pixels"]
        if half_width == 0:
            return centre
        sides = [self._range(motion, bearings + s * half_width, amounts) for s in (-1, 1)]
        nearest = np.minimum(np.minimum(centre, sides[0]), sides[1])
        farthest = np.max(
            [np.where(r < self._lidar.range_max, r, nearest) for r in (centre, *sides)], axis=0
        )
        share = self._memory.streams["mixed_pixels"].random(len(bearings))
        return np.asarray(nearest + share * (farthest - nearest))

    def _range(self, motion: Motion, bearings: Array, amounts: Mapping[str, float]) -> Array:
        """(n,) ideal ranges, at most range_max, m."""
        caster, reach = self._caster(amounts["lidar.glass"]), self._lidar.range_max
        duration = amounts["lidar.motion_skew"]
        if duration == 0:
            T = motion.T_world_base @ self._lidar.T_base_lidar
            directions = np.empty((len(bearings), 3))
            _aim(bearings, T, directions)
            return caster.cast(T[:3, 3], directions, reach)
        T = self._sweep(motion, duration)
        beams = np.column_stack([np.cos(bearings), np.sin(bearings), np.zeros(len(bearings))])
        directions = (T[:, :3, :3] @ beams[:, :, None])[..., 0]
        directions /= np.linalg.norm(directions, axis=1, keepdims=True)
        return caster.cast(T[:, :3, 3], directions, reach)

    def _sweep(self, motion: Motion, duration: float) -> Array:
        """(n, 4, 4) poses of the lidar as it sends each beam: the last one now, the first ago."""
        ages = np.linspace(duration, 0.0, _SWEEP_POSES)
        poses = np.array([motion.pose_at(age) @ self._lidar.T_base_lidar for age in ages])
        at = np.linspace(0.0, _SWEEP_POSES - 1, self._lidar.n_beams)
        before = np.minimum(at.astype(int), _SWEEP_POSES - 2)
        later = (at - before)[:, None, None]
        return np.asarray((1 - later) * poses[before] + later * poses[before + 1])

    def _kept(self, dropout: float) -> NDArray[np.bool_]:
        """(n,) which beams return: each is lost with this probability."""
        if dropout == 0:
            return self._all
        drawn = self._memory.streams["dropout"].random(self._lidar.n_beams)
        return np.asarray(drawn >= dropout)

    def _caster(self, glass: float) -> RayCaster:
        """Rays through a world of which this share of the solids is glass."""
        if glass not in self._casters:
            assert self._world is not None, "enter() comes first"
            seen = _without(self._world, self._memory.opacity < glass)
            self._casters[glass] = RayCaster(seen)
        return self._casters[glass]


def _without(world: World, gone: NDArray[np.bool_]) -> World:
    """The world less some of its solids and cylinders, in that order."""
    s, c = world.solids, world.cylinders
    stay, up = ~gone[: len(s)], ~gone[len(s) :]
    solids = Boxes(s.centre[stay], s.half_extents[stay], s.yaw[stay], s.texture[stay])
    cylinders = Cylinders(c.centre[up], c.radius[up], c.half_height[up], c.texture[up])
    return replace(world, solids=solids, cylinders=cylinders)


@kernel
def _aim(bearings: Any, T: Any, directions: Any) -> None:
    """Write the unit vectors (n, 3) of beams (n,) in the x-y plane of T (4, 4)."""
    for i in range(bearings.size):
        c, s = math.cos(bearings[i]), math.sin(bearings[i])
        for k in range(3):
            directions[i, k] = T[k, 0] * c + T[k, 1] * s


@kernel
def _tell(
    ideal: Any,
    sigma: float,
    noise: Any,
    kept: Any,
    quantum: float,
    reach: float,
    shortest: float,
    longest: float,
    told: Any,
) -> None:
    """What is told of ideal ranges: the longest where nothing returns from within reach."""
    for i in range(ideal.size):
        r = longest
        if kept[i] and ideal[i] < reach:
            r = ideal[i] + sigma * noise[i]
            if quantum > 0:
                r = quantum * math.floor(r / quantum + 0.5)
        told[i] = np.float32(min(max(r, shortest), longest))
