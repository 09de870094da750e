"""The yard: walled, gravelled, strewn with boxes around a clear place in its middle; and the depot,
where none of them is so low that a lidar looks over it."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from grouser.envs.simulation.ground import Ground
from grouser.envs.simulation.materials import TEXTURES
from grouser.envs.simulation.world import Boxes, World, join
from grouser.envs.simulation.worlds.placement import NoPlace
from grouser.envs.simulation.worlds.reachability import ROBOT_RADIUS
from grouser.geometry import Array

_BRICK, _CONCRETE = TEXTURES.index("brick"), TEXTURES.index("concrete")
_HALF_SIZE = 9.0  # m, from the centre to the inner face of a wall
_TRIES = 200
_SMALLEST, _LARGEST = (0.12, 0.12, 0.10), (0.50, 0.50, 0.90)
_SMALLEST_IN_SIGHT = (0.12, 0.12, 0.30)
"""Half extents, m: of a box that stands higher than the robot's lidar."""


def yard(rng: np.random.Generator, difficulty: float, clutter: float) -> World:
    """A walled gravel yard, 18 x 18 m, with boxes strewn around a clear place in its middle.

    Difficulty: from 20 to 60 boxes, and a clear place of 5 down to 2 m.
    """
    return _strewn("yard", rng, difficulty, clutter, _SMALLEST)


def depot(rng: np.random.Generator, difficulty: float, clutter: float) -> World:
    """The yard, but with boxes of at least 0.6 m: what a robot can run into, its lidar sees.

    Difficulty: that of the yard.
    """
    return _strewn("depot", rng, difficulty, clutter, _SMALLEST_IN_SIGHT)


def _strewn(
    name: str,
    rng: np.random.Generator,
    difficulty: float,
    clutter: float,
    smallest: Sequence[float],
) -> World:
    """A yard whose boxes have at least these half extents (3,)."""
    start = np.append(rng.uniform(-1.5, 1.5, 2), rng.uniform(-np.pi, np.pi))
    walls = _walls(_HALF_SIZE, thickness=0.3, height=2.5)
    clear_radius = 5.0 - 3.0 * difficulty
    n = round(clutter * (20 + 40 * difficulty))
    obstacles = _strewn_boxes(rng, n, smallest, start[:2], clear_radius + ROBOT_RADIUS)
    return World(
        name=name,
        solids=join(obstacles, walls),
        n_walls=len(walls),
        ground=Ground.flat(_HALF_SIZE + 0.3, "gravel"),
        start=start,
        clear_radius=clear_radius,
    )


def _walls(half_size: float, *, thickness: float, height: float) -> Boxes:
    """Four walls around a square; those along x close the corners."""
    reach, half = half_size + thickness / 2, thickness / 2
    centre = [[reach, 0], [-reach, 0], [0, reach], [0, -reach]]
    extents = [[half, half_size]] * 2 + [[half_size + thickness, half]] * 2
    return Boxes(
        centre=np.column_stack([centre, np.full(4, height / 2)]),
        half_extents=np.column_stack([extents, np.full(4, height / 2)]),
        yaw=np.zeros(4),
        texture=np.full(4, _BRICK),
    )


def _strewn_boxes(
    rng: np.random.Generator, n: int, smallest: Sequence[float], start: ArrayLike, clearance: float
) -> Boxes:
    """Boxes that touch neither each other nor the place around the start."""
    positions: list[Array] = [np.asarray(start, dtype=np.float64)]
    radii: list[float] = [clearance]
    half_extents = rng.uniform(smallest, _LARGEST, (n, 3))
    for half in half_extents:
        radius = float(np.hypot(half[0], half[1]))
        positions.append(_free_position(rng, radius, np.array(positions), np.array(radii)))
        radii.append(radius)
    return Boxes(
        centre=np.column_stack([np.array(positions[1:]), half_extents[:, 2]]),
        half_extents=half_extents,
        yaw=rng.uniform(-np.pi, np.pi, n),
        texture=rng.integers(_BRICK, _CONCRETE + 1, n),
    )


def _free_position(
    rng: np.random.Generator, radius: float, taken: Array, taken_radii: Array
) -> Array:
    """A place for a circle that overlaps no taken one."""
    reach = _HALF_SIZE - radius
    for _ in range(_TRIES):
        candidates = rng.uniform(-reach, reach, (16, 2))
        apart = candidates[:, None] - taken
        distance = np.sqrt(apart[..., 0] ** 2 + apart[..., 1] ** 2)
        free = np.flatnonzero((distance > taken_radii + radius).all(axis=1))
        if free.size:
            return np.asarray(candidates[free[0]])
    raise NoPlace
