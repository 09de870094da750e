"""A way through the goals of a world that is known: planned on its free space.

The robot's operator knows the world; an estimator does not. So this plans courses for comparisons
in worlds where a figure-eight would end in a tree.
"""

import numpy as np

from grouser.agents.free_graph import Ways, clear_graph
from grouser.envs.simulation.world import World
from grouser.envs.simulation.worlds.reachability import free_space
from grouser.geometry import Array

SPACING = 0.4
"""Between waypoints, m."""


def plan_tour(world: World) -> Array:
    """(n, 2) waypoints about SPACING apart from the start through all goals, m, world frame.

    The nearest goal that is left comes next. Ways keep away from obstacles where they can.

    Raises:
        ValueError: the world has no goals, or one that the robot cannot drive to.
    """
    if not len(world.goals):
        raise ValueError(f"the world {world.name!r} has no goals to drive to")
    space = free_space(world)
    graph = clear_graph(space)
    left, at, legs = list(world.goals), world.start[:2], []
    while left:
        way_to = Ways(space, graph, at)
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


def _spaced(way: Array) -> Array:
    """The way's points at equal distances along it, its end included."""
    steps = np.linalg.norm(np.diff(way, axis=0), axis=1)
    along = np.append(0.0, np.cumsum(steps))
    n = max(1, round(along[-1] / SPACING))
    at = np.linspace(0, along[-1], n + 1)[1:]
    return np.column_stack([np.interp(at, along, way[:, k]) for k in range(2)])
