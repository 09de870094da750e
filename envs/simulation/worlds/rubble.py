"""Rubble: what a building leaves when it falls: slabs of all heights, broken blocks, ruins."""

import math

import numpy as np

from grouser.envs.simulation.ground import Ground
from grouser.envs.simulation.world import Boxes, Cylinders, World, join
from grouser.envs.simulation.worlds.light import overcast
from grouser.envs.simulation.worlds.noise import patches
from grouser.envs.simulation.worlds.placement import (
    Circles,
    draw_textures,
    enclosure,
    scatter,
    standing_boxes,
    standing_cylinders,
    texture_index,
)
from grouser.envs.simulation.worlds.reachability import ROBOT_RADIUS
from grouser.envs.simulation.worlds.relief import Waves, level_ground, with_hills, with_material
from grouser.envs.simulation.worlds.slabs import apart_from, laid_slabs
from grouser.geometry import Array

_REACH = (11.0, 11.0)  # m


def rubble(rng: np.random.Generator, difficulty: float, clutter: float) -> World:
    """Rough ground under slabs and blocks, 22 x 22 m, within broken walls.

    Difficulty: 60 to 180 slabs, the highest from 4 to 9 cm; 12 to 40 blocks that are no way through
    and gaps between them from 1.2 to 0.8 m; slopes up to 4 to 16 degrees, in short waves; dust on
    up to a quarter of the ground, which slips like mud.
    """
    start = np.append(rng.uniform(-3, 3, 2), rng.uniform(-np.pi, np.pi))
    clear_radius = 1.5 - 0.7 * difficulty
    ground = _ground(rng, difficulty, start)
    here = Circles(start[:2], clear_radius + ROBOT_RADIUS)
    gap = 1.2 - 0.4 * difficulty
    ruins, taken = _ruins(rng, 5, ground, here, gap)
    blocks, taken = _blocks(rng, round(clutter * (12 + 28 * difficulty)), ground, taken, gap)
    columns = _columns(rng, 6, ground, taken, gap)
    slabs = _slabs(rng, round(clutter * (60 + 120 * difficulty)), ground, difficulty)
    walls = enclosure(ground, _REACH, height=1.6, segment=3.0, texture="brick")
    return World(
        name="rubble",
        solids=join(blocks, ruins, walls),
        n_walls=len(walls),
        ground=ground,
        start=start,
        clear_radius=clear_radius,
        cylinders=columns,
        slabs=apart_from(slabs, start[:2], clear_radius + ROBOT_RADIUS),
        light=overcast(strength=1.0 - 0.3 * difficulty),
    )


def _ground(rng: np.random.Generator, difficulty: float, start: Array) -> Ground:
    ground = level_ground(_REACH, "gravel")
    floor = patches(rng, ground.material.shape, ground.cell, share=0.3, size=2.5)
    dust = patches(rng, ground.material.shape, ground.cell, share=0.25 * difficulty, size=1.5)
    return with_hills(
        rng,
        with_material(with_material(ground, floor, "cement"), dust, "mud"),
        steepest=math.radians(4 + 12 * difficulty),
        waves=[Waves(4.0, 10.0), Waves(0.8, 2.0, 0.7)],
        level_at=start[:2],
        level_radius=1.0,
    )


def _ruins(
    rng: np.random.Generator, n: int, ground: Ground, taken: Circles, gap: float
) -> tuple[Boxes, Circles]:
    """Pieces of wall that still stand."""
    size = rng.uniform((1.5, 0.25, 0.8), (3.5, 0.35, 2.2), (n, 3))
    return _strewn(rng, size, ground, taken, gap, "brick", "blocks")


def _blocks(
    rng: np.random.Generator, n: int, ground: Ground, taken: Circles, gap: float
) -> tuple[Boxes, Circles]:
    size = rng.uniform((0.3, 0.25, 0.15), (1.0, 0.8, 0.8), (n, 3))
    return _strewn(rng, size, ground, taken, gap, "concrete", "blocks", "brick", "plaster")


def _strewn(
    rng: np.random.Generator,
    size: Array,
    ground: Ground,
    taken: Circles,
    gap: float,
    *textures: str,
) -> tuple[Boxes, Circles]:
    """Boxes of sizes (n, 3), as many as find a place, and what is taken with them."""
    n, radius = len(size), np.hypot(size[:, 0], size[:, 1]) / 2
    places, which = scatter(rng, radius, _REACH, taken, gap=gap)
    yaw, texture = rng.uniform(0, np.pi, n), draw_textures(rng, n, *textures)
    boxes = standing_boxes(ground, places, size[which], yaw[which], texture[which])
    return boxes, taken.plus(places, radius[which])


def _columns(
    rng: np.random.Generator, n: int, ground: Ground, taken: Circles, gap: float
) -> Cylinders:
    """What is left of the columns that bore the roof."""
    radius, height = rng.uniform(0.1, 0.25, n), rng.uniform(0.8, 3.0, n)
    places, which = scatter(rng, radius, _REACH, taken, gap=gap)
    concrete = texture_index("concrete")
    return standing_cylinders(ground, places, radius[which], height[which], concrete)


def _slabs(rng: np.random.Generator, n: int, ground: Ground, difficulty: float) -> Boxes:
    xy = rng.uniform(-1, 1, (n, 2)) * (np.array(_REACH) - 0.5)
    size = rng.uniform((0.25, 0.2, 0.02), (0.9, 0.6, 0.04 + 0.05 * difficulty), (n, 3))
    yaw = rng.uniform(0, np.pi, n)
    return laid_slabs(
        ground, xy, size, yaw, draw_textures(rng, n, "concrete", "blocks", "brick", "plaster")
    )
