"""The forest: random trees on hills, with logs, roots and rocks, in failing light."""

import math

import numpy as np

from grouser.envs.simulation.ground import Ground
from grouser.envs.simulation.world import Boxes, World, join
from grouser.envs.simulation.worlds.light import overcast
from grouser.envs.simulation.worlds.meadow import meadow
from grouser.envs.simulation.worlds.placement import (
    Circles,
    draw_textures,
    enclosure,
    scatter,
    standing_boxes,
    texture_index,
)
from grouser.envs.simulation.worlds.reachability import ROBOT_RADIUS
from grouser.envs.simulation.worlds.relief import Waves
from grouser.envs.simulation.worlds.slabs import along_contours, apart_from, laid_slabs
from grouser.envs.simulation.worlds.trees import grown_trees
from grouser.geometry import Array

_REACH = (16.0, 16.0)  # m


def forest(rng: np.random.Generator, difficulty: float, clutter: float) -> World:
    """Trees of all ages wherever they like, 32 x 32 m, within a thicket.

    Difficulty: 60 to 130 trees with gaps from 1.5 to 1.0 m, 6 to 16 rocks, 10 to 35 fallen logs and
    as many roots up to 8 cm high, slopes up to 8 to 20 degrees, mud on up to a fifth of the ground,
    and light that is dimmer by up to a half and halves again within two minutes.
    """
    start = np.append(rng.uniform(-6, 6, 2), rng.uniform(-np.pi, np.pi))
    clear_radius = 1.6 - 0.8 * difficulty
    ground = meadow(
        rng,
        _REACH,
        start,
        mud=0.2 * difficulty,
        steepest=math.radians(8 + 12 * difficulty),
        waves=[Waves(9.0, 20.0), Waves(1.5, 3.0, 0.3)],
    )
    here = Circles(start[:2], clear_radius + ROBOT_RADIUS)
    n_trees = round(clutter * (60 + 70 * difficulty))
    xy, radius = _places(rng, n_trees, here, gap=1.5 - 0.5 * difficulty)
    n = len(radius)
    trunks, crowns = grown_trees(
        ground,
        xy,
        radius,
        clearance=rng.uniform(1.5, 3.0, n),
        crown_width=1.0 + 6 * radius * rng.uniform(0.8, 1.2, n),
        crown_height=rng.uniform(2.0, 4.0, n),
        yaw=rng.uniform(0, np.pi / 2, n),
    )
    standing = here.plus(xy, radius)
    rocks = _rocks(rng, round(clutter * (6 + 10 * difficulty)), ground, standing)
    thicket = enclosure(ground, _REACH, height=2.2, segment=4.0, texture="foliage")
    n_low = round(clutter * (10 + 25 * difficulty))
    low = join(_logs(rng, n_low, ground), _roots(rng, n_low, ground, xy, radius))
    return World(
        name="forest",
        solids=join(rocks, crowns, thicket),
        n_walls=len(thicket),
        ground=ground,
        start=start,
        clear_radius=clear_radius,
        cylinders=trunks,
        slabs=apart_from(low, start[:2], clear_radius + ROBOT_RADIUS),
        light=overcast(
            strength=0.9 - 0.4 * difficulty,
            half_life=120 / difficulty if difficulty > 0 else np.inf,
        ),
    )


def _places(rng: np.random.Generator, n: int, here: Circles, *, gap: float) -> tuple[Array, Array]:
    """Where the trees stand (k, 2) and how thick they are (k,), m: many young, few old."""
    radius = np.clip(0.11 * np.exp(0.5 * rng.standard_normal(n)), 0.05, 0.35)
    xy, which = scatter(rng, radius, _REACH, here, gap=gap)
    return xy, radius[which]


def _rocks(rng: np.random.Generator, n: int, ground: Ground, taken: Circles) -> Boxes:
    size = rng.uniform((0.3, 0.3, 0.15), (0.9, 0.8, 0.7), (n, 3))
    places, which = scatter(rng, np.hypot(size[:, 0], size[:, 1]) / 2, _REACH, taken, gap=0.2)
    yaw, texture = rng.uniform(0, np.pi, n), draw_textures(rng, n, "pebbles", "concrete", "gravel")
    return standing_boxes(ground, places, size[which], yaw[which], texture[which])


def _logs(rng: np.random.Generator, n: int, ground: Ground) -> Boxes:
    """Fallen logs, which have come to lie across the slope."""
    xy = rng.uniform(-1, 1, (n, 2)) * (np.array(_REACH) - 1.5)
    size = rng.uniform((0.8, 0.10, 0.05), (2.5, 0.20, 0.08), (n, 3))
    yaw = along_contours(ground, xy, rng.uniform(-0.15, 0.15, n))
    return laid_slabs(ground, xy, size, yaw, texture_index("bark"))


def _roots(rng: np.random.Generator, n: int, ground: Ground, trunks: Array, radius: Array) -> Boxes:
    """Roots, which start at trunks."""
    tree = rng.integers(0, len(radius), n)
    length, yaw = rng.uniform(0.5, 1.2, n), rng.uniform(-np.pi, np.pi, n)
    away = (radius[tree] + length / 2)[:, None] * np.column_stack([np.cos(yaw), np.sin(yaw)])
    size = np.column_stack([length, rng.uniform(0.06, 0.12, n), rng.uniform(0.03, 0.06, n)])
    return laid_slabs(ground, trunks[tree] + away, size, yaw, texture_index("bark"))
