"""A planar lidar: exact ranges along slightly wrong bearings, then range noise, then faults."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from grouser.envs.sensors.base import Reading, Sensor
from grouser.envs.sensors.streams import Streams
from grouser.envs.simulation.motion import Motion
from grouser.envs.simulation.raycast import RayCaster
from grouser.envs.simulation.world import Boxes, Cylinders, World
from grouser.geometry import Array
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
        ideal = self._spread_range(motion, bearings, amounts)
        returned = ideal < (1 - amounts["lidar.range_loss"]) * lidar.range_max
        if amounts["lidar.dropout"] > 0:
            returned &= self._kept(amounts["lidar.dropout"])
        measured = _quantised(
            ideal + amounts["lidar.range_noise"] * range_noise, amounts["lidar.quantisation"]
        )
        shown = np.where(returned, measured, lidar.range_max)
        bounded = np.minimum(np.maximum(shown, lidar.range_min), lidar.range_max)
        return {"lidar": bounded.astype(np.float32)}

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
        beams = np.zeros((len(bearings), 3))
        np.cos(bearings, out=beams[:, 0])
        np.sin(bearings, out=beams[:, 1])
        caster, reach = self._caster(amounts["lidar.glass"]), self._lidar.range_max
        duration = amounts["lidar.motion_skew"]
        if duration == 0:
            T = motion.T_world_base @ self._lidar.T_base_lidar
            return caster.cast(T[:3, 3], beams @ T[:3, :3].T, reach)
        T = self._sweep(motion, duration)
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


def _quantised(ranges: Array, step: float) -> Array:
    return np.asarray(step * np.floor(ranges / step + 0.5)) if step > 0 else ranges
