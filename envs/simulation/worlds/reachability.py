"""Where a robot of some radius can be, and where it can drive to.

Everything that blocks is a box with rounded corners seen from above: solids and trunks, slabs that
stand too high for tracks, cells of the ground that are too steep. What hangs higher than the robot
is tall (the crown of a tree, the top of a table) blocks nothing.
"""

import math
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import ndimage

from grouser.envs.simulation.ground import Ground
from grouser.envs.simulation.world import Boxes, World
from grouser.envs.simulation.worlds.footprint import heights_under, select
from grouser.envs.simulation.worlds.relief import cell_slopes
from grouser.geometry import Array
from grouser.kernels import kernel

ROBOT_RADIUS: Final = 0.4
"""Of the circle around the robot seen from above, rounded up, m."""

HEADROOM: Final = 0.6
"""What is at least this high above the ground lets the robot pass below, m."""

HIGHEST_STEP: Final = 0.09
"""Tracks climb slabs up to this height, m."""

STEEPEST: Final = math.radians(22)
"""Steeper ground counts as blocked, rad."""

_TOLERANCE = 1e-6


@dataclass(frozen=True, slots=True, eq=False)
class FreeSpace:
    """An occupancy grid: where the robot's centre may be."""

    free: NDArray[np.bool_]
    """(rows, columns); a row is one y, a column one x."""
    cell: float
    """Side of a cell, m."""
    origin: Array
    """(2,) x and y of the middle of free[0, 0], m."""

    def index(self, xy: ArrayLike) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Rows and columns (...) of the cells nearest to points (..., 2)."""
        rows, columns = self.free.shape
        nearest = np.rint((np.asarray(xy) - self.origin) / self.cell).astype(np.int64)
        return np.clip(nearest[..., 1], 0, rows - 1), np.clip(nearest[..., 0], 0, columns - 1)

    def at(self, xy: ArrayLike) -> NDArray[np.bool_]:
        """(...) whether points (..., 2) are free, by the cell that they are nearest to."""
        return np.asarray(self.free[self.index(xy)])

    def points(self) -> Array:
        """(n, 2) the middles of all free cells, row by row, m."""
        return np.argwhere(self.free)[:, ::-1] * self.cell + self.origin


def free_space(world: World, *, radius: float = ROBOT_RADIUS, cell: float = 0.1) -> FreeSpace:
    """The occupancy grid of a world for a robot of a radius [m], over all of its ground."""
    ground = world.ground
    rows, columns = (np.array(ground.material.shape) * ground.cell / cell).astype(np.int64)
    blocked = np.zeros((rows, columns), dtype=np.bool_)
    origin = ground.origin + cell / 2
    for boxes in (_standing(world.solids, ground), _too_high(world.slabs, ground)):
        _block(blocked, boxes, np.full(len(boxes), radius), cell, origin)
    trunks, steep = world.cylinders, _steep_cells(ground)
    _block(blocked, _points(trunks.centre[:, :2]), trunks.radius + radius, cell, origin)
    _block(blocked, steep, np.full(len(steep), radius), cell, origin)
    return FreeSpace(~blocked, cell, origin)


def reachable(space: FreeSpace, start: ArrayLike) -> FreeSpace:
    """That part of a free space to which a robot can drive from a place (2,); maybe none."""
    labels, _ = ndimage.label(space.free)
    label = labels[space.index(start)]
    return FreeSpace((labels == label) & (label > 0), space.cell, space.origin)


def _standing(solids: Boxes, ground: Ground) -> Boxes:
    """Those solids that the robot does not pass below."""
    bottom = solids.centre[:, 2] - solids.half_extents[:, 2]
    return select(solids, bottom < heights_under(solids, ground).max(axis=1) + HEADROOM)


def _too_high(slabs: Boxes, ground: Ground) -> Boxes:
    """Those slabs that stand higher above the ground around them than tracks climb."""
    rise = slabs.centre[:, 2] + slabs.half_extents[:, 2] - heights_under(slabs, ground).min(axis=1)
    return select(slabs, rise > HIGHEST_STEP + _TOLERANCE)


def _steep_cells(ground: Ground) -> Boxes:
    row, column = np.nonzero(cell_slopes(ground.heights, ground.cell) > math.tan(STEEPEST))
    middle = ground.origin + (np.column_stack([column, row]) + 0.5) * ground.cell
    return _points(middle, half=ground.cell / 2)


def _points(xy: Array, *, half: float = 0.0) -> Boxes:
    """Squares (n, 2) of some half side, of which only the footprint counts."""
    n = len(xy)
    zero = np.zeros(n)
    extents = np.column_stack([np.full((n, 2), half), zero])
    return Boxes(np.column_stack([xy, zero]), extents, zero, np.zeros(n, dtype=np.int64))


def _block(
    blocked: NDArray[np.bool_], boxes: Boxes, margin: Array, cell: float, origin: Array
) -> None:
    """Mark the cells whose middle is nearer to a box than its margin (n,)."""
    turn = np.column_stack([np.cos(boxes.yaw), np.sin(boxes.yaw)])
    _block_boxes(blocked, boxes.centre, boxes.half_extents, turn, margin, cell, origin)


@kernel
def _block_boxes(
    blocked: Any, centre: Any, half: Any, turn: Any, margin: Any, cell: float, origin: Any
) -> None:
    rows, columns = blocked.shape
    for k in range(centre.shape[0]):
        c, s = turn[k, 0], turn[k, 1]
        reach_x = abs(c) * half[k, 0] + abs(s) * half[k, 1] + margin[k]
        reach_y = abs(s) * half[k, 0] + abs(c) * half[k, 1] + margin[k]
        x, y = centre[k, 0] - origin[0], centre[k, 1] - origin[1]
        first_row = max(0, int(math.ceil((y - reach_y) / cell)))
        last_row = min(rows - 1, int(math.floor((y + reach_y) / cell)))
        first_column = max(0, int(math.ceil((x - reach_x) / cell)))
        last_column = min(columns - 1, int(math.floor((x + reach_x) / cell)))
        for row in range(first_row, last_row + 1):
            for column in range(first_column, last_column + 1):
                dx, dy = column * cell - x, row * cell - y
                beside = max(0.0, abs(c * dx + s * dy) - half[k, 0])
                before = max(0.0, abs(c * dy - s * dx) - half[k, 1])
                if beside * beside + before * before < margin[k] * margin[k]:
                    blocked[row, column] = True
