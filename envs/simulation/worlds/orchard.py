"""The orchard: rows of trees on gently uneven grass, puddles of mud, an evening."""

import math

import numpy as np

from grouser.envs.simulation.world import Light, World, join
from grouser.envs.simulation.worlds.light import sunlight
from grouser.envs.simulation.worlds.meadow import meadow
from grouser.envs.simulation.worlds.placement import (
    Circles,
    draw_textures,
    enclosure,
    scatter,
    standing_boxes,
)
from grouser.envs.simulation.worlds.reachability import ROBOT_RADIUS
from grouser.envs.simulation.worlds.relief import Waves
from grouser.envs.simulation.worlds.trees import grown_trees
from grouser.geometry import Array

_REACH = (15.0, 12.0)  # m
_JITTER, _THICKEST = 0.15, 0.15  # m
_MISSING = 0.12  # share of the trees


def orchard(rng: np.random.Generator, difficulty: float, clutter: float) -> World:
    """Rows of trees along x, 30 x 24 m.

    Difficulty: rows from 4.2 to 3.2 m apart, crowns that hang from 1.4 to 0.9 m above the ground,
    slopes from 2 to 10 degrees, mud on up to a fifth of the ground, 4 to 14 crates, and a sun from
    45 degrees down to 10 whose light halves within two minutes.
    """
    between = 4.2 - difficulty
    clear_radius = between / 2 - _JITTER - _THICKEST - ROBOT_RADIUS
    start = _in_an_alley(rng, between)
    ground = meadow(
        rng,
        _REACH,
        start,
        mud=0.2 * difficulty,
        steepest=math.radians(2 + 8 * difficulty),
        waves=[Waves(6.0, 16.0), Waves(1.5, 3.0, 0.2)],
    )
    light = _evening(rng, difficulty)
    xy = _rows(rng, between)
    n = len(xy)
    trunks, crowns = grown_trees(
        ground,
        xy,
        rng.uniform(0.07, _THICKEST, n),
        clearance=rng.uniform(0, 0.3, n) + 1.4 - 0.5 * difficulty,
        crown_width=rng.uniform(1.5, 2.2, n),
        crown_height=rng.uniform(1.4, 2.2, n),
        yaw=rng.uniform(0, np.pi / 2, n),
    )
    hedge = enclosure(ground, _REACH, height=1.8, texture="foliage")
    taken = Circles(start[:2], clear_radius + ROBOT_RADIUS).plus(xy, trunks.radius)
    n_crates = round(clutter * (4 + 10 * difficulty))
    side = rng.uniform(0.3, 0.6, n_crates)
    places, which = scatter(rng, side / math.sqrt(2), _REACH, taken)
    crates = standing_boxes(
        ground,
        places,
        np.column_stack([side, side, rng.uniform(0.3, 0.8, n_crates)])[which],
        rng.uniform(0, np.pi / 2, n_crates)[which],
        draw_textures(rng, n_crates, "bark", "blocks")[which],
    )
    return World(
        name="orchard",
        solids=join(crates, crowns, hedge),
        n_walls=len(hedge),
        ground=ground,
        start=start,
        clear_radius=clear_radius,
        cylinders=trunks,
        light=light,
    )


def _in_an_alley(rng: np.random.Generator, between: float) -> Array:
    """A pose in the middle between the two innermost rows, looking along them."""
    heading = rng.choice([0.0, np.pi]) + rng.uniform(-0.2, 0.2)
    return np.array([rng.uniform(-9, 9), rng.choice([-1, 1]) * between / 2, heading])


def _rows(rng: np.random.Generator, between: float) -> Array:
    """(n, 2) of the trees: in rows, but not quite, and some are gone."""
    n_rows = int((_REACH[1] - 1.0) // between)
    x, y = np.arange(-13.2, 13.3, 2.4), between * np.arange(-n_rows, n_rows + 1)
    grid = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    grown = rng.random(len(grid)) > _MISSING
    return np.asarray((grid + rng.uniform(-_JITTER, _JITTER, grid.shape))[grown])


def _evening(rng: np.random.Generator, difficulty: float) -> Light:
    return sunlight(
        rng.uniform(-np.pi, np.pi),
        math.radians(45 - 35 * difficulty),
        half_life=120 / difficulty if difficulty > 0 else np.inf,
    )
