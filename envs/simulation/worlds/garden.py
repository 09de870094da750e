"""The garden: cement paths through grass, beds, hedges, a few trees, gentle slopes."""

import math

import numpy as np

from grouser.envs.simulation.ground import Ground
from grouser.envs.simulation.world import Boxes, Cylinders, World, join
from grouser.envs.simulation.worlds.light import sunlight
from grouser.envs.simulation.worlds.noise import patches
from grouser.envs.simulation.worlds.placement import (
    Allowed,
    Circles,
    draw_textures,
    enclosure,
    scatter,
    standing_boxes,
    texture_index,
)
from grouser.envs.simulation.worlds.reachability import ROBOT_RADIUS
from grouser.envs.simulation.worlds.relief import (
    Waves,
    cell_positions,
    level_ground,
    with_hills,
    with_material,
)
from grouser.envs.simulation.worlds.slabs import apart_from, laid_slabs
from grouser.envs.simulation.worlds.trees import grown_trees
from grouser.geometry import Array

_REACH = (14.0, 11.0)  # m
_RING = (9.5, 7.0)  # half sides of the path that leads around, m


def garden(rng: np.random.Generator, difficulty: float, clutter: float) -> World:
    """A crossing of two paths, and one that leads around, in a hedged garden of 28 x 22 m.

    Difficulty: paths from 2.0 to 1.4 m wide with 2 to 8 steps of up to 3 to 8 cm, 10 to 26 beds and
    pots, 4 to 12 hedges, 5 to 11 trees, slopes up to 2 to 9 degrees, mud on up to a sixth of the
    grass, and a sun from 50 degrees down to 20.
    """
    width = 2.0 - 0.6 * difficulty
    clear_radius = 1.6 - 0.7 * difficulty
    start = np.append(rng.uniform(-0.2, 0.2, 2), rng.choice(4) * np.pi / 2 + rng.uniform(-0.3, 0.3))
    ground = _ground(rng, difficulty, width, start)
    light = sunlight(rng.uniform(-np.pi, np.pi), math.radians(50 - 30 * difficulty))
    beside, taken = _beside_paths(width), Circles(start[:2], clear_radius + ROBOT_RADIUS)
    n_trees, n_hedges, n_beds = (
        round(clutter * n) for n in (5 + 6 * difficulty, 4 + 8 * difficulty, 10 + 16 * difficulty)
    )
    trunks, crowns, taken = _trees(rng, n_trees, ground, taken, beside)
    hedges, taken = _hedges(rng, n_hedges, ground, taken, beside)
    beds = _beds(rng, n_beds, ground, taken, beside)
    steps = _steps(rng, round(2 + 6 * difficulty), ground, width, 0.03 + 0.05 * difficulty)
    walls = enclosure(ground, _REACH, height=1.4, texture="foliage", thickness=0.5)
    return World(
        name="garden",
        solids=join(beds, hedges, crowns, walls),
        n_walls=len(walls),
        ground=ground,
        start=start,
        clear_radius=clear_radius,
        cylinders=trunks,
        slabs=apart_from(steps, start[:2], clear_radius + ROBOT_RADIUS),
        light=light,
    )


def _ground(rng: np.random.Generator, difficulty: float, width: float, start: Array) -> Ground:
    ground = level_ground(_REACH, "grass")
    mud = patches(rng, ground.material.shape, ground.cell, share=difficulty / 6, size=1.5)
    paved = _to_path(cell_positions(ground)) < width / 2
    return with_hills(
        rng,
        with_material(with_material(ground, mud, "mud"), paved, "cement"),
        steepest=math.radians(2 + 7 * difficulty),
        waves=[Waves(7.0, 16.0)],
        level_at=start[:2],
        level_radius=1.0,
    )


def _to_path(xy: Array) -> Array:
    """(...) distance of points (..., 2) from the middle line of the nearest path, m."""
    x, y = np.abs(xy[..., 0]), np.abs(xy[..., 1])
    beyond_x, beyond_y = np.maximum(x - _RING[0], 0), np.maximum(y - _RING[1], 0)
    crossing = np.minimum(np.hypot(x, beyond_y), np.hypot(y, beyond_x))
    ring = np.minimum(np.hypot(x - _RING[0], beyond_y), np.hypot(y - _RING[1], beyond_x))
    return np.asarray(np.minimum(crossing, ring))


def _beside_paths(width: float) -> Allowed:
    return lambda xy, radius: _to_path(xy) > width / 2 + radius


def _trees(
    rng: np.random.Generator, n: int, ground: Ground, taken: Circles, beside: Allowed
) -> tuple[Cylinders, Boxes, Circles]:
    radius = rng.uniform(0.08, 0.2, n)
    xy, which = scatter(rng, radius, _REACH, taken, gap=2.0, allowed=beside)
    radius, k = radius[which], len(which)
    trunks, crowns = grown_trees(
        ground,
        xy,
        radius,
        clearance=rng.uniform(1.2, 2.0, k),
        crown_width=rng.uniform(1.6, 2.8, k),
        crown_height=rng.uniform(1.5, 3.0, k),
        yaw=rng.uniform(0, np.pi / 2, k),
    )
    return trunks, crowns, taken.plus(xy, radius)


def _hedges(
    rng: np.random.Generator, n: int, ground: Ground, taken: Circles, beside: Allowed
) -> tuple[Boxes, Circles]:
    """Hedges along x or y."""
    size = rng.uniform((1.5, 0.4, 0.6), (2.8, 0.6, 1.2), (n, 3))
    radius = np.hypot(size[:, 0], size[:, 1]) / 2
    xy, which = scatter(rng, radius, _REACH, taken, gap=0.5, allowed=beside)
    yaw = rng.choice([0.0, np.pi / 2], n)[which]
    hedges = standing_boxes(ground, xy, size[which], yaw, texture_index("foliage"))
    return hedges, taken.plus(xy, radius[which])


def _beds(
    rng: np.random.Generator, n: int, ground: Ground, taken: Circles, beside: Allowed
) -> Boxes:
    """Raised beds and pots."""
    size = rng.uniform((0.4, 0.4, 0.2), (1.4, 0.8, 0.6), (n, 3))
    radius = np.hypot(size[:, 0], size[:, 1]) / 2
    xy, which = scatter(rng, radius, _REACH, taken, gap=0.5, allowed=beside)
    texture = draw_textures(rng, n, "foliage", "foliage", "brick", "blocks", "pebbles", "bark")
    yaw = rng.choice([0.0, np.pi / 2], n)
    return standing_boxes(ground, xy, size[which], yaw[which], texture[which])


def _steps(rng: np.random.Generator, n: int, ground: Ground, width: float, highest: float) -> Boxes:
    """Steps across the four arms of the crossing and the sides of the ring."""
    across_x = rng.random(n) < 0.5
    along = rng.uniform(0.3, 0.85, n) * rng.choice([-1, 1], n)
    line = rng.choice([-1, 0, 1], n)
    xy = np.where(
        across_x[:, None],
        np.column_stack([along * _RING[0], line * _RING[1]]),
        np.column_stack([line * _RING[0], along * _RING[1]]),
    )
    size = np.column_stack(
        [rng.uniform(0.25, 0.5, n), np.full(n, width), rng.uniform(0.02, highest, n)]
    )
    return laid_slabs(ground, xy, size, np.where(across_x, 0.0, np.pi / 2), texture_index("blocks"))
