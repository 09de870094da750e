"""The corridor: passages around blocks of rooms, some walled up, always with a loop."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from grouser.envs.simulation.ground import Ground
from grouser.envs.simulation.world import Boxes, World, join
from grouser.envs.simulation.worlds.light import lamplight
from grouser.envs.simulation.worlds.partition import WALL_HEIGHT, WALL_THICKNESS, wall_with_door
from grouser.envs.simulation.worlds.passages import Passage, all_passages, spare_passages
from grouser.envs.simulation.worlds.placement import (
    draw_textures,
    enclosure,
    standing_boxes,
    texture_index,
)
from grouser.envs.simulation.worlds.reachability import ROBOT_RADIUS
from grouser.envs.simulation.worlds.relief import level_ground
from grouser.envs.simulation.worlds.slabs import laid_slabs
from grouser.geometry import Array

_COLUMNS: Final = 3
_ROWS: Final = 2
_N_ROOMS = 2
_DOOR = 1.1  # width, m
_WALL_TEXTURES = ("plaster", "brick", "blocks", "concrete")


@dataclass(frozen=True, slots=True)
class _Plan:
    """A grid of equal blocks with passages around them, in the middle of the world."""

    block: Array
    """(2,) sides of a block along x and y, m."""
    width: float
    """Of the passages, m."""

    @property
    def reach(self) -> Array:
        """(2,) from the middle to the outer walls, m."""
        return (np.array([_COLUMNS, _ROWS]) * (self.block + self.width) + self.width) / 2

    @property
    def blocks(self) -> Array:
        """(n, 2) the middles of the blocks, m."""
        corners = [(i, j) for j in range(_ROWS) for i in range(_COLUMNS)]
        return self.crossing(corners) + (self.block + self.width) / 2

    def crossing(self, index: ArrayLike) -> Array:
        """(..., 2) the middles of crossings (..., 2), counted along x and y, m."""
        return self.width / 2 - self.reach + np.asarray(index) * (self.block + self.width)

    def middle(self, passage: Passage) -> Array:
        """(2,) of a passage, m."""
        here, there = passage.ends
        return (self.crossing(here) + self.crossing(there)) / 2


def corridor(rng: np.random.Generator, difficulty: float, clutter: float) -> World:
    """Passages around 3 x 2 blocks, about 21 x 15 m; two of the blocks are rooms with a door.

    Difficulty: passages from 2.2 to 1.4 m wide, of which none to five are walled up (one loop is
    always left), 4 to 11 cabinets along the walls, sills of 1 to 6 cm in the doors, a floor that is
    polished to 0.7 of its friction, and lamps dimmed to 0.6.
    """
    plan = _Plan(rng.uniform((3.6, 3.6), (5.0, 4.6)), 2.2 - 0.8 * difficulty)
    crossing = rng.integers(0, (_COLUMNS + 1, _ROWS + 1))
    start = np.append(plan.crossing(crossing), rng.choice(4) * np.pi / 2)
    ground = level_ground(plan.reach, "cement", friction_scale=1 - 0.3 * difficulty)
    closed = spare_passages(rng, _COLUMNS, _ROWS)[: round(5 * difficulty)]
    barriers = _barriers(ground, plan, closed)
    rooms = rng.permutation(len(plan.blocks)) < _N_ROOMS
    blocks, sills = _blocks(rng, ground, plan, rooms, 0.01 + 0.05 * difficulty)
    walls = enclosure(ground, plan.reach, height=WALL_HEIGHT, segment=30.0, texture="plaster")
    things = _things(rng, ground, plan.blocks[rooms])
    cabinets = _cabinets(rng, round(clutter * (4 + 7 * difficulty)), ground, plan)
    return World(
        name="corridor",
        solids=join(cabinets, things, barriers, blocks, walls),
        n_walls=len(barriers) + len(blocks) + len(walls),
        ground=ground,
        start=start,
        clear_radius=plan.width / 2 - ROBOT_RADIUS - 0.02,
        slabs=sills,
        light=lamplight(strength=1 - 0.4 * difficulty**2),
    )


def _barriers(ground: Ground, plan: _Plan, closed: Sequence[Passage]) -> Boxes:
    """A wall across the middle of every passage that is closed."""
    middles = np.array([plan.middle(passage) for passage in closed]).reshape(-1, 2)
    yaw = np.array([passage.axis for passage in closed]) * np.pi / 2
    size = (WALL_THICKNESS, plan.width, WALL_HEIGHT)
    return standing_boxes(ground, middles, size, yaw, texture_index("brick"))


def _blocks(
    rng: np.random.Generator, ground: Ground, plan: _Plan, rooms: NDArray[np.bool_], rise: float
) -> tuple[Boxes, Boxes]:
    """The blocks, of which some are rooms with a door, and the sills of the doors."""
    textures = draw_textures(rng, len(plan.blocks), *_WALL_TEXTURES)
    to_door = np.array([(plan.block[0] - WALL_THICKNESS) / 2, plan.block[1] / 4])
    boxes, doors = [], []
    for middle, is_room, texture in zip(plan.blocks, rooms, textures.tolist(), strict=True):
        if is_room:
            doors.append(middle + rng.choice([-1, 1], 2) * to_door)
            boxes.append(_room(ground, middle, plan.block, doors[-1], texture))
        else:
            size = (*plan.block, WALL_HEIGHT)
            boxes.append(standing_boxes(ground, middle, size, 0.0, texture))
    sill = (WALL_THICKNESS + 0.1, _DOOR, rise)
    return join(*boxes), laid_slabs(ground, doors, sill, 0.0, texture_index("bark"))


def _room(ground: Ground, middle: Array, block: Array, door: Array, texture: int) -> Boxes:
    """Four walls, one of them with a door, in the place of a block."""
    inner = block - WALL_THICKNESS
    ends = (middle[1] - block[1] / 2 + WALL_THICKNESS, middle[1] + block[1] / 2 - WALL_THICKNESS)
    along_x = middle + np.array([[0, inner[1] / 2], [0, -inner[1] / 2]])
    opposite = np.array([2 * middle[0] - door[0], middle[1]])
    return join(
        standing_boxes(ground, along_x, (block[0], WALL_THICKNESS, WALL_HEIGHT), 0.0, texture),
        standing_boxes(
            ground, opposite, (WALL_THICKNESS, ends[1] - ends[0], WALL_HEIGHT), 0.0, texture
        ),
        wall_with_door(ground, door, ends, _DOOR, texture),
    )


def _things(rng: np.random.Generator, ground: Ground, middles: Array) -> Boxes:
    """One about the middle of every room."""
    n = len(middles)
    places, size = middles + rng.uniform(-0.3, 0.3, (n, 2)), rng.uniform(0.3, 0.7, (n, 3))
    yaw, textures = rng.uniform(0, np.pi, n), draw_textures(rng, n, "bark", "blocks", "concrete")
    return standing_boxes(ground, places, size, yaw, textures)


def _cabinets(rng: np.random.Generator, n: int, ground: Ground, plan: _Plan) -> Boxes:
    """Cabinets along the walls of passages along x, where no door opens; none opposite another."""
    along_x = [passage for passage in all_passages(_COLUMNS, _ROWS) if passage.axis == 0]
    slots = np.array(
        [plan.middle(p) + [part * plan.block[0], 0] for p in along_x for part in (-0.25, 0.25)]
    )
    slots = rng.permutation(slots)[:n]
    k = len(slots)
    size = rng.uniform((0.4, 0.2, 0.5), (0.9, 0.35, 1.8), (k, 3))
    beside = rng.choice([-1, 1], k) * (plan.width - size[:, 1]) / 2
    textures = draw_textures(rng, k, "bark", "concrete", "pebbles", "blocks")
    return standing_boxes(ground, slots + np.column_stack([np.zeros(k), beside]), size, 0, textures)
