"""A classical driver with a map: plans a way through the known world and pursues a point on it."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from grouser.agents.driver import Action, Driver
from grouser.agents.free_graph import Ways, clear_graph
from grouser.agents.waypoints import action_toward
from grouser.envs.simulation.world import World
from grouser.envs.simulation.worlds.reachability import FreeSpace, free_space, reachable
from grouser.estimators.base import PoseEstimate, Status
from grouser.geometry import Array, between, compose
from grouser.rig import Rig

_AHEAD = 0.5
"""How far along the way the point is that the robot drives towards, m."""
_STRAY = 1.0
"""Further than this from its way the robot believes itself off it and plans another, m."""


class Pursuit(Driver):
    """Plans on the free space of the known world, from where the robot believes it is, clear of
    obstacles where there is room; then drives towards the point half a metre further on.

    It trusts the map and the estimate alone and looks at no sensor: what the estimate is off, the
    robot is off its way. A robot that is LOST stands still.
    """

    task: Mapping[str, Any] = {"policy_sensors": ()}

    def reset(self, rig: Rig, world: World) -> None:
        """A new episode in a known world."""
        self._rig, self._start = rig, world.start
        space = free_space(world)
        self._space = reachable(space, world.start[:2]) if space.at(world.start[:2]) else space
        self._graph = clear_graph(self._space)
        self._goal: Array | None = None

    def action(
        self, observation: Mapping[str, NDArray[Any]], believed: PoseEstimate, goal: Array
    ) -> Action:
        """Towards a point further on along the way, or at rest."""
        if believed.status is Status.LOST:
            return np.zeros(2, dtype=np.float32)
        at = believed.pose[:2]
        if self._goal is None or not np.array_equal(goal, self._goal) or self._strayed(at):
            self._plan(at, goal)
        target = self._further_on(at)
        return action_toward(believed, target, self._rig).astype(np.float32)

    def _plan(self, at: Array, goal: Array) -> None:
        """Keep the way (n, 2) to the goal, m, frame of the start."""
        self._goal = goal.copy()
        here, there = (_nearest_free(self._space, self._in_world(place)) for place in (at, goal))
        cells = Ways(self._space, self._graph, here).points(there)[:-1]
        placed = np.column_stack([cells, np.zeros(len(cells))])
        self._way = np.concatenate([at[None], between(self._start, placed)[:, :2], goal[None]])

    def _strayed(self, at: Array) -> bool:
        return float(np.linalg.norm(self._way - at, axis=1).min()) > _STRAY

    def _further_on(self, at: Array) -> Array:
        """(2,) the way's first point that is some way beyond the one nearest to a place."""
        nearest = int(np.argmin(np.linalg.norm(self._way - at, axis=1)))
        rest = self._way[nearest:]
        beyond = np.cumsum(np.linalg.norm(np.diff(rest, axis=0), axis=1)) >= _AHEAD
        return np.asarray(rest[1 + int(np.argmax(beyond))] if beyond.any() else rest[-1])

    def _in_world(self, place: Array) -> Array:
        return np.asarray(compose(self._start, [*place, 0.0])[:2])


def _nearest_free(space: FreeSpace, place: Array) -> Array:
    """(2,) a place itself where it is free, else the middle of the nearest free cell, m."""
    if space.at(place):
        return place
    row, column = space.index(place)
    nearest = ndimage.distance_transform_edt(
        ~space.free, return_distances=False, return_indices=True
    )
    row, column = nearest[:, row, column]
    return np.asarray(np.array([column, row]) * space.cell + space.origin)
