"""Free space as a graph of cells, and how far each of them is from a place."""

import numpy as np
from scipy import sparse
from scipy.sparse.csgraph import dijkstra

from grouser.envs.simulation.worlds.reachability import FreeSpace
from grouser.geometry import Array


def grid_graph(space: FreeSpace, cost: Array | None = None) -> sparse.csr_matrix:
    """Free cells and their eight neighbours; a step is as long as it is, m, times the mean cost
    (rows, columns) of the two cells."""
    cost = np.ones(space.free.shape) if cost is None else cost
    nodes = np.arange(space.free.size).reshape(space.free.shape)
    starts, ends, lengths = [], [], []
    for down, right in ((0, 1), (1, 0), (1, 1), (1, -1)):
        here, there = _shifted(down, right)
        # Both cells beside a diagonal must be free too, or the way would cut a corner.
        beside = space.free[there[0], here[1]] & space.free[here[0], there[1]]
        free = space.free[here] & space.free[there] & beside
        starts.append(nodes[here][free])
        ends.append(nodes[there][free])
        lengths.append(space.cell * np.hypot(down, right) * (cost[here] + cost[there])[free] / 2)
    i, j, w = (np.concatenate(parts) for parts in (starts, ends, lengths))
    n = space.free.size
    return sparse.csr_matrix((np.tile(w, 2), (np.append(i, j), np.append(j, i))), shape=(n, n))


def node(space: FreeSpace, place: Array) -> int:
    """The cell nearest to a place (2,), as a node of the graph."""
    row, column = space.index(place)
    return int(np.ravel_multi_index((int(row), int(column)), space.free.shape))


class WayField:
    """The length of the shortest way to one place from everywhere.

    Ways go from cell to cell of eight neighbours, so that a length exceeds that of the straight
    line by up to 8 % where the line lies askew to the grid.
    """

    def __init__(self, space: FreeSpace, place: Array) -> None:
        """The field of a place (2,) [m, world frame] in a free space."""
        self._space = space
        (lengths,) = dijkstra(grid_graph(space), indices=[node(space, place)])
        self._lengths = np.asarray(lengths)

    def length(self, place: Array) -> float:
        """m from a place (2,); infinity where there is no way."""
        return float(self._lengths[node(self._space, place)])


_HERE_AND_THERE = {
    0: (slice(None), slice(None)),
    1: (slice(None, -1), slice(1, None)),
    -1: (slice(1, None), slice(None, -1)),
}
"""All indices that have a neighbour so much further on, and those neighbours."""


def _shifted(down: int, right: int) -> tuple[tuple[slice, slice], tuple[slice, slice]]:
    """All cells that have a neighbour so many rows down and columns to the right; those."""
    rows, columns = _HERE_AND_THERE[down], _HERE_AND_THERE[right]
    return (rows[0], columns[0]), (rows[1], columns[1])
