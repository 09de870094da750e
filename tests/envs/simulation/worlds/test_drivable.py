"""What a world calls reachable, the robot truly reaches: on its tracks, over slabs and hills."""

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.csgraph import dijkstra

from grouser.envs.simulation.robot import RobotModel, TrackedRobot
from grouser.envs.simulation.world import World
from grouser.envs.simulation.worlds.reachability import FreeSpace, free_space, reachable
from grouser.envs.simulation.worlds.registry import make_world, world_names
from grouser.geometry import Array, project, wrap

GOALS = 3
AHEAD = 4  # cells


@pytest.mark.parametrize("name", world_names())
def test_the_robot_drives_to_its_goals(name: str) -> None:
    """At the highest difficulty, without touching anything; one failure is bad luck: a simple
    driver may stall with one track on a root."""
    world = make_world(name, np.random.default_rng(1), difficulty=1.0)
    robot = TrackedRobot(RobotModel(), dt=0.1, dynamics="fast")
    try:
        arrived = [drives_along(robot, world, path) for path in paths(world)]
    finally:
        robot.close()
    assert sum(arrived) >= GOALS - 1


def paths(world: World) -> list[Array]:
    """(n, 2) shortest ways over free cells to the first goals, m; wide ones are preferred."""
    space = reachable(free_space(world), world.start[:2])
    number = np.cumsum(space.free).reshape(space.free.shape) - 1
    start, *goals = number[space.index(np.vstack([world.start[:2], world.goals[:GOALS]]))].tolist()
    _, before = dijkstra(graph(space, number), indices=start, return_predecessors=True)
    places, ways = space.points(), []
    for goal in goals:
        way = [goal]
        while way[-1] != start:
            way.append(int(before[way[-1]]))
        ways.append(places[way[::-1]])
    return ways


def graph(space: FreeSpace, number: NDArray[np.int64]) -> Any:
    """Of all pairs of neighbouring free cells, a step near to obstacles being a long one."""
    wider = free_room(space)
    edges = []
    for d_row, d_column in ((0, 1), (1, 0), (1, 1), (1, -1)):
        there = np.roll(space.free, (-d_row, -d_column), axis=(0, 1)) & space.free
        row, column = np.nonzero(there)
        others = number[(row + d_row), (column + d_column)]
        cost = np.hypot(d_row, d_column) * (1.0 + 2.0 * ~wider[row, column])
        edges.append(np.column_stack([number[row, column], others, cost]))
    here, there, cost = np.concatenate(edges).T
    n = int(space.free.sum())
    both = np.concatenate([here, there]).astype(int), np.concatenate([there, here]).astype(int)
    return sparse.csr_matrix((np.tile(cost, 2), both), shape=(n, n))


def free_room(space: FreeSpace) -> NDArray[np.bool_]:
    """Cells with only free ones two cells around."""
    room = space.free.copy()
    for shift in ((2, 0), (-2, 0), (0, 2), (0, -2)):
        room &= np.roll(space.free, shift, axis=(0, 1))
    return room


def drives_along(robot: TrackedRobot, world: World, path: Array) -> bool:
    """Follow a point ahead on the path; whether the robot arrives untouched in twice the time."""
    motion, k = robot.enter(world), 0
    for _ in range(200 + 6 * len(path)):
        x, y, heading = project(motion.T_world_base)
        if np.hypot(path[-1, 0] - x, path[-1, 1] - y) < 0.25:
            return True
        k += int(np.argmin(np.linalg.norm(path[k : k + 15] - [x, y], axis=1)))
        aim = path[min(k + AHEAD, len(path) - 1)]
        error = float(wrap(np.arctan2(aim[1] - y, aim[0] - x) - heading))
        forward = 0.45 * np.cos(error) ** 2 if abs(error) < 1.2 else 0.0
        turn = 0.3 * np.clip(2 * error, -1, 1)
        motion = robot.step(np.clip(np.array([forward - turn, forward + turn]), -0.5, 0.5))
        if motion.collision:
            return False
    return False
