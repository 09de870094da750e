"""Free space as a graph of cells, and the shortest ways on it from one place to all others."""

import math
from typing import Any

import numpy as np
from scipy import ndimage, sparse
from scipy.sparse.csgraph import dijkstra

from grouser.envs.simulation.worlds.reachability import FreeSpace
from grouser.geometry import Array
from grouser.kernels import kernel

_ROOM = 0.5  # m; clear ways keep about this much further from obstacles where there is space


def grid_graph(space: FreeSpace, cost: Array | None = None) -> sparse.csr_matrix:
    """Free cells and their eight neighbours; a step is as long as it is, m, times the mean cost
    (rows, columns) of the two cells."""
    cost = np.ones(space.free.shape) if cost is None else cost
    n = space.free.size
    first, ends, lengths = np.zeros(n + 1, np.int32), np.empty(8 * n, np.int32), np.empty(8 * n)
    n_steps = _join(space.free, cost, space.cell, first, ends, lengths)
    return sparse.csr_matrix((lengths[:n_steps], ends[:n_steps], first), shape=(n, n))


def clear_graph(space: FreeSpace) -> sparse.csr_matrix:
    """The same; a step costs more near obstacles, so that ways keep clear of them."""
    clearance = ndimage.distance_transform_edt(space.free) * space.cell
    return grid_graph(space, 1 + np.square(np.clip(1 - clearance / (2 * _ROOM), 0, 1)) * 8)


class Ways:
    """Shortest ways between one place and all others.

    They go from cell to cell of eight neighbours, so that a length on a `grid_graph` exceeds that
    of the straight line by up to 8 % where the line lies askew to the grid.
    """

    def __init__(self, space: FreeSpace, graph: sparse.csr_matrix, place: Array) -> None:
        """The ways from a place (2,) [m, world frame] on a graph of a free space."""
        self._space, self._place = space, np.asarray(place, dtype=np.float64)
        found = dijkstra(graph, indices=[_node(space, place)], return_predecessors=True)
        self._lengths, self._before = found[0][0], found[1][0]

    def length(self, place: Array) -> float:
        """m times cost, to a place (2,); infinity where there is no way."""
        return float(self._lengths[_node(self._space, place)])

    def points(self, place: Array) -> Array:
        """(n, 2) the way's cells to a place but the first; for the last, the place itself."""
        nodes = [_node(self._space, place)]
        while self._before[nodes[-1]] >= 0:
            nodes.append(int(self._before[nodes[-1]]))
        row, column = np.unravel_index(nodes[::-1], self._space.free.shape)
        way = np.column_stack([column, row]) * self._space.cell + self._space.origin
        return np.concatenate([way[1:-1], place[None]])

    def taut_length(self, place: Array) -> float:
        """m, of the way to a place pulled taut; infinity where there is none."""
        if not np.isfinite(self.length(place)):
            return float("inf")
        way = pulled_taut(self._space, np.concatenate([self._place[None], self.points(place)]))
        return float(np.linalg.norm(np.diff(way, axis=0), axis=1).sum())


def pulled_taut(space: FreeSpace, way: Array) -> Array:
    """(m, 2) of a way's points (n, 2), those that are needed: each sees the next across free space.

    Straight lines between them are no longer bound to the grid's eight directions.
    """
    cells = (way - space.origin) / space.cell
    return np.asarray(way[_corners(space.free, cells)])


def _node(space: FreeSpace, place: Array) -> int:
    """The cell nearest to a place (2,), as a node of the graph; `FreeSpace.index` of a single one,
    which is asked for at every step, by hand."""
    rows, columns = space.free.shape
    (x, y), (left, bottom) = place.tolist(), space.origin.tolist()
    row = min(max(round((y - bottom) / space.cell), 0), rows - 1)
    column = min(max(round((x - left) / space.cell), 0), columns - 1)
    return int(row * columns + column)


@kernel
def _join(free: Any, cost: Any, cell: float, first: Any, ends: Any, lengths: Any) -> int:
    """Write the steps from every cell as the rows of a compressed sparse matrix; how many."""
    rows, columns = free.shape
    n = 0
    for row in range(rows):
        for column in range(columns):
            for down in range(-1, 2):
                for right in range(-1, 2):
                    i, j = row + down, column + right
                    inside = 0 <= i < rows and 0 <= j < columns
                    if not inside or (down == 0 and right == 0):
                        continue
                    # Both cells beside a diagonal must be free too, or the way would cut a corner.
                    if not (free[row, column] and free[i, j] and free[i, column] and free[row, j]):
                        continue
                    length = cell * math.sqrt(down * down + right * right)
                    ends[n] = i * columns + j
                    lengths[n] = length * (cost[row, column] + cost[i, j]) / 2
                    n += 1
            first[row * columns + column + 1] = n
    return n


@kernel
def _corners(free: Any, cells: Any) -> Any:
    """Indices of the points that stay: from each, the next is the last one before the first that it
    does not see."""
    n = cells.shape[0]
    kept = np.empty(n, dtype=np.int64)
    kept[0], count, at = 0, 1, 0
    while at < n - 1:
        reach = at + 1
        while reach + 1 < n and _sees(free, cells[at], cells[reach + 1]):
            reach += 1
        kept[count], count, at = reach, count + 1, reach
    return kept[:count]


@kernel
def _sees(free: Any, a: Any, b: Any) -> bool:
    """Whether all cells are free that the line from a to b goes through, column by column."""
    (x, y), (end_x, end_y) = (a, b) if a[0] <= b[0] else (b, a)
    for column in range(int(np.rint(x)), int(np.rint(end_x)) + 1):
        enters, leaves = max(x, column - 0.5), min(end_x, column + 0.5)
        slope = (end_y - y) / (end_x - x) if end_x > x else 0.0
        first = y + slope * (enters - x)
        last = y + slope * (leaves - x) if end_x > x else end_y
        for row in range(int(np.rint(min(first, last))), int(np.rint(max(first, last))) + 1):
            if not free[row, column]:
                return False
    return True
