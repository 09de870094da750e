"""The room: plaster walls, furniture, and a second room behind a door with a sill."""

import numpy as np

from grouser.envs.simulation.ground import Ground
from grouser.envs.simulation.world import Boxes, World, join
from grouser.envs.simulation.worlds.furniture import CHAIR, TABLE, chair, table
from grouser.envs.simulation.worlds.light import lamplight
from grouser.envs.simulation.worlds.partition import WALL_HEIGHT, WALL_THICKNESS, wall_with_door
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
from grouser.envs.simulation.worlds.relief import level_ground
from grouser.envs.simulation.worlds.slabs import laid_slabs
from grouser.geometry import Array


def room(rng: np.random.Generator, difficulty: float, clutter: float) -> World:
    """Two furnished rooms, 12 to 16 m long and 10 to 12 m wide in all, joined by a door.

    Difficulty: a door from 1.6 to 1.1 m wide with a sill from 1 to 7 cm, 2 to 5 tables with two
    chairs each, 4 to 12 cupboards, 4 to 12 boxes on the floor, a floor that is polished to 0.7 of
    its friction, and lamps dimmed to 0.6.
    """
    reach = np.array([rng.integers(24, 33) / 4, rng.integers(20, 25) / 4])
    clear_radius = 1.6 - 0.8 * difficulty
    door = np.array([rng.uniform(0.15, 0.35) * reach[0], rng.uniform(-0.6, 0.6) * reach[1]])
    middle = (door[0] - reach[0]) / 2  # of the larger room, which is the one with negative x
    start = np.append([middle, 0] + rng.uniform(-1, 1, 2), rng.normal(0, 0.5))
    ground = level_ground(reach, "cement", friction_scale=1 - 0.3 * difficulty)
    width = 1.6 - 0.5 * difficulty
    partition = wall_with_door(ground, door, (-reach[1], reach[1]), width, texture_index("plaster"))
    sill = (WALL_THICKNESS + 0.1, width, 0.01 + 0.06 * difficulty)
    walls = enclosure(ground, reach, height=WALL_HEIGHT, segment=20.0, texture="plaster")
    taken = Circles([start[:2], door], [clear_radius + ROBOT_RADIUS, 1.2])
    cupboards, taken = _cupboards(
        rng, round(clutter * (4 + 8 * difficulty)), ground, reach, door[0], taken
    )
    furniture = _furniture(rng, clutter, difficulty, ground, reach, door[0], taken)
    return World(
        name="room",
        solids=join(furniture, cupboards, partition, walls),
        n_walls=len(partition) + len(walls),
        ground=ground,
        start=start,
        clear_radius=clear_radius,
        slabs=laid_slabs(ground, door, sill, 0.0, texture_index("bark")),
        light=lamplight(strength=1 - 0.4 * difficulty**2),
    )


def _cupboards(
    rng: np.random.Generator, n: int, ground: Ground, reach: Array, x_wall: float, taken: Circles
) -> tuple[Boxes, Circles]:
    """Cupboards and shelves with their backs to the long outer walls, two metres apart."""
    x = np.arange(-reach[0] + 1.0, reach[0] - 0.8, 2.0)
    x = x[np.abs(x - x_wall) > 1.0]
    slots = np.column_stack([np.tile(x, 2), np.repeat([-1.0, 1.0], len(x))])
    slots = rng.permutation(slots)[:n]
    k = len(slots)
    size = rng.uniform((0.8, 0.3, 0.8), (1.6, 0.5, 2.0), (k, 3))
    xy = np.column_stack([slots[:, 0], slots[:, 1] * (reach[1] - size[:, 1] / 2)])
    textures = draw_textures(rng, k, "bark", "blocks", "concrete", "brick")
    cupboards = standing_boxes(ground, xy, size, 0.0, textures)
    return cupboards, taken.plus(xy, cupboards.footprint_radius)


def _furniture(
    rng: np.random.Generator,
    clutter: float,
    difficulty: float,
    ground: Ground,
    reach: Array,
    x_wall: float,
    taken: Circles,
) -> Boxes:
    """Tables with chairs, and boxes between them; room to pass everywhere."""
    n_tables, n_boxes = (round(clutter * n) for n in (2 + 3 * difficulty, 4 + 8 * difficulty))
    side = rng.uniform(0.25, 0.6, n_boxes)
    radius = np.append(np.full(n_tables, TABLE[0] / 2 + 0.35), side / np.sqrt(2))
    gap = 0.95 - 0.1 * difficulty
    places, which = scatter(rng, radius, reach, taken, gap=gap, allowed=_beside(x_wall))
    yaw = rng.uniform(-np.pi, np.pi, len(radius))
    tables = which < n_tables
    groups = [
        _table_with_chairs(rng, ground, xy, yaw[k])
        for xy, k in zip(places[tables], which[tables], strict=True)
    ]
    boxes, chosen = places[~tables], which[~tables] - n_tables
    size = np.column_stack([side, side, rng.uniform(0.2, 0.7, n_boxes)])[chosen]
    textures = draw_textures(rng, n_boxes, "blocks", "bark", "concrete", "pebbles")[chosen]
    return join(standing_boxes(ground, boxes, size, yaw[which[~tables]], textures), *groups)


def _table_with_chairs(rng: np.random.Generator, ground: Ground, xy: Array, yaw: float) -> Boxes:
    """A table, and a chair on either long side that is more or less pushed below it."""
    across = np.array([-np.sin(yaw), np.cos(yaw)])
    away = TABLE[1] / 2 + rng.uniform(0.0, 0.25, 2)
    chairs = [
        chair(ground, xy + side * distance * across, yaw + side * np.pi / 2)
        for side, distance in zip((1, -1), away - CHAIR / 4, strict=True)
    ]
    return join(table(ground, xy, yaw), *chairs)


def _beside(x_wall: float) -> Allowed:
    """Clear of the wall between the rooms."""
    return lambda xy, radius: np.abs(xy[:, 0] - x_wall) > radius + WALL_THICKNESS
