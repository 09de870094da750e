"""A way through the goals of a world that is known: planned on its free space.

The robot's operator knows the world; an estimator does not. So this plans courses for comparisons
in worlds where a figure-eight would end in a tree.
"""

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage, sparse
from scipy.sparse.csgraph import dijkstra

from grouser.agents.free_graph import grid_graph, node
from grouser.envs.simulation.world import World
from grouser.envs.simulation.worlds.reachability import FreeSpace, free_space
from grouser.geometry import Array

SPACING = 0.4
"""Between waypoints, m."""

_ROOM = 0.5  # m; the way keeps about this much further from obstacles where there is space


def plan_tour(world: World) -> Array:
    """(n, 2) waypoints about SPACING apart from the start through all goals, m, world frame.

    The nearest goal that is left comes next. Ways keep away from obstacles where they can.

    Raises:
        ValueError: the world has no goals, or one that the robot cannot drive to.
    """
    if not len(world.goals):
        raise ValueError(f"the world {world.name!r} has no goals to drive to")
    space = free_space(world)
    graph = _graph(space)
    left, at, legs = list(world.goals), world.start[:2], []
    while left:
        way_to = _ways_from(graph, space, at)
        lengths = [way_to.length(goal) for goal in left]
        nearest = int(np.argmin(lengths))
        if lengths[nearest] == np.inf:
            raise ValueError(
                f"the robot cannot drive from {at} to any of the goals {left} of the world "
                f"{world.name!r}: not everywhere on the way is room for it"
            )
        at = left.pop(nearest)
        legs.append(way_to.points(at))
    return _spaced(np.concatenate([world.start[None, :2], *legs]))


class _Ways:
    """Shortest ways from one place to all others."""

    def __init__(self, space: FreeSpace, lengths: Array, before: NDArray[np.int32]) -> None:
        self._space, self._lengths, self._before = space, lengths, before

    def length(self, place: Array) -> float:
        """m, more near obstacles; infinity where there is no way."""
        return float(self._lengths[node(self._space, place)])

    def points(self, place: Array) -> Array:
        """(n, 2) the way's cells, the place itself last."""
        nodes = [node(self._space, place)]
        while self._before[nodes[-1]] >= 0:
            nodes.append(int(self._before[nodes[-1]]))
        row, column = np.unravel_index(nodes[::-1], self._space.free.shape)
        way = np.column_stack([column, row]) * self._space.cell + self._space.origin
        return np.concatenate([way[1:-1], place[None]])


def _ways_from(graph: sparse.csr_matrix, space: FreeSpace, place: Array) -> _Ways:
    lengths, before = dijkstra(graph, indices=[node(space, place)], return_predecessors=True)
    return _Ways(space, lengths[0], before[0])


def _graph(space: FreeSpace) -> sparse.csr_matrix:
    """A step costs more near obstacles."""
    clearance = ndimage.distance_transform_edt(space.free) * space.cell
    return grid_graph(space, 1 + np.square(np.clip(1 - clearance / (2 * _ROOM), 0, 1)) * 8)


def _spaced(way: Array) -> Array:
    """The way's points at equal distances along it, its end included."""
    steps = np.linalg.norm(np.diff(way, axis=0), axis=1)
    along = np.append(0.0, np.cumsum(steps))
    n = max(1, round(along[-1] / SPACING))
    at = np.linspace(0, along[-1], n + 1)[1:]
    return np.column_stack([np.interp(at, along, way[:, k]) for k in range(2)])
