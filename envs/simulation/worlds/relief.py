"""The shape of the ground: hills of bounded slope, level where the robot starts."""

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from grouser.envs.simulation.ground import Ground
from grouser.envs.simulation.materials import material_index
from grouser.envs.simulation.worlds.noise import smooth_noise
from grouser.geometry import Array

MARGIN = 0.5
"""How far the ground goes on beyond the inner faces of what encloses a world, m."""

CELL = 0.25
"""Side of a cell of the ground, m."""

_RAMP = 3.0  # m, over which hills rise from the level place


class Waves(NamedTuple):
    """A band of hills."""

    shortest: float
    longest: float
    """Wavelength, m."""
    share: float = 1.0
    """Steepest slope, in proportion to that of other bands."""


def level_ground(reach: ArrayLike, material: str, *, friction_scale: float = 1.0) -> Ground:
    """A level rectangle around the world's origin, `reach` (2,) to its enclosure, in cells."""
    half = np.asarray(reach) + MARGIN
    columns, rows = np.rint(2 * half / CELL).astype(int)
    return Ground(
        heights=np.zeros((rows + 1, columns + 1)),
        material=np.full((rows, columns), material_index(material)),
        cell=CELL,
        origin=-half,
        friction_scale=friction_scale,
    )


def with_material(ground: Ground, where: NDArray[np.bool_], material: str) -> Ground:
    """The ground with other material in some cells (rows, columns)."""
    changed = np.where(where, material_index(material), ground.material)
    return replace(ground, material=changed)


def with_hills(
    rng: np.random.Generator,
    ground: Ground,
    *,
    steepest: float,
    waves: Sequence[Waves],
    level_at: ArrayLike,
    level_radius: float,
) -> Ground:
    """The ground with hills.

    Args:
        steepest: slope of its steepest triangle, rad.
        waves: the bands of which the hills are made.
        level_at: (2,) where height and slope are zero.
        level_radius: how far from there they still are, m.
    """
    shape = ground.heights.shape
    hills = np.zeros(shape)
    for wave in waves:
        noise = smooth_noise(rng, shape, ground.cell, shortest=wave.shortest, longest=wave.longest)
        hills += wave.share * noise / cell_slopes(noise, ground.cell).max()
    nodes = node_positions(ground)
    distance = np.linalg.norm(nodes - np.asarray(level_at), axis=-1)
    middle = hills.ravel()[int(np.argmin(distance))]
    ramp = np.clip((distance - level_radius - 1.5 * ground.cell) / _RAMP, 0, 1)
    heights = (hills - middle) * ramp * ramp * (3 - 2 * ramp)
    heights *= math.tan(steepest) / cell_slopes(heights, ground.cell).max()
    return replace(ground, heights=np.round(heights, 4))


def cell_slopes(heights: Array, cell: float) -> Array:
    """(rows, columns) slope (rise over run) of the steeper triangle of every cell, as `Ground`
    splits it."""
    along_x, along_y = (np.diff(heights, axis=axis) ** 2 for axis in (1, 0))
    steeper = np.maximum(along_x[:-1] + along_y[:, 1:], along_x[1:] + along_y[:, :-1])
    return np.asarray(np.sqrt(steeper) / cell)


def node_positions(ground: Ground) -> Array:
    """(rows + 1, columns + 1, 2) x and y of the nodes of a ground, m."""
    rows, columns = ground.heights.shape
    x = ground.origin[0] + ground.cell * np.arange(columns)
    y = ground.origin[1] + ground.cell * np.arange(rows)
    return np.stack(np.meshgrid(x, y), axis=-1)


def cell_positions(ground: Ground) -> Array:
    """(rows, columns, 2) x and y of the middles of the cells of a ground, m."""
    return node_positions(ground)[:-1, :-1] + ground.cell / 2
