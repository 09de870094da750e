"""One episode of the goal task as it truly goes: progress, outcome, and what `info` says of it."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from grouser.agents.free_graph import Ways, grid_graph
from grouser.envs.simulation.world import World
from grouser.envs.simulation.worlds.reachability import free_space
from grouser.geometry import Array, compose

SUCCESS_RADIUS: Final = 0.3
"""The robot has reached its goal where it truly is this near, m."""

RUNNING, REACHED, SUCCESS, MISSED, COLLISION, TIMEOUT = (
    "running",
    "reached",
    "success",
    "missed",
    "collision",
    "timeout",
)
"""Outcomes: under way; stopped at a goal that is not the last; stopped at the last; stopped
elsewhere; touched something; out of time."""


@dataclass(frozen=True, slots=True)
class Reward:
    """What the reward is made of; a step's is their sum."""

    progress: float = 1.0
    """For each metre that the shortest way through the goals has become shorter."""
    success: float = 10.0
    """At every goal."""
    missed: float = -2.0
    collision: float = -5.0
    step: float = -0.01
    """For each step."""

    def of(self, progress: float, outcome: str) -> float:
        """The reward of a step that came nearer by some progress [m] and ended so."""
        ends = {
            REACHED: self.success,
            SUCCESS: self.success,
            MISSED: self.missed,
            COLLISION: self.collision,
        }
        return self.progress * progress + self.step + ends.get(outcome, 0.0)


class GoalScore:
    """Follows an episode by the truth. It never sees an estimate, and no observation sees it.

    Args:
        world: where the robot is.
        goals: (k, 2) m, in the frame of the start, one after another.
    """

    def __init__(self, world: World, goals: Array) -> None:
        self._start, self._goals = world.start, goals
        space = free_space(world)
        graph = grid_graph(space)
        self._ways = [Ways(space, graph, self._in_world(goal)) for goal in goals]
        stations = [world.start[:2], *map(self._in_world, goals[:-1])]
        legs = list(zip(self._ways, stations, strict=True))
        self._legs = [ways.length(station) for ways, station in legs]
        self._position = np.zeros(2)
        self.distance = math.dist(self._position, goals[0])
        """The straight line to the goal that the robot drove to in the last step, m."""
        self._on_leg = self._legs[0]
        self._reached = 0
        self.path_length = 0.0
        self.shortest_path = sum(ways.taut_length(station) for ways, station in legs)
        """Through all goals, m; `remaining_path` is by the grid's eight directions and exceeds it
        by up to 8 % at first."""

    @property
    def goal(self) -> Array:
        """(2,) m, in the frame of the start: the one to drive to now, after the last that one."""
        return np.asarray(self._goals[min(self._reached, len(self._goals) - 1)])

    @property
    def remaining_path(self) -> float:
        """The shortest way through the goals that are left, m."""
        return 0.0 if self._is_done else self._on_leg + sum(self._legs[self._reached + 1 :])

    def advance(self, truth: Mapping[str, Any]) -> float:
        """Take the truth after a step; how much shorter the way through the goals is now, m."""
        before, position = self._on_leg, truth["true_pose"][:2]
        self.path_length += math.dist(self._position, position)
        self._position = position.copy()
        self.distance = math.dist(position, self.goal)
        there = self._ways[self._reached].length(self._in_world(position))
        # A place too narrow for the circle around the robot has no way: the last length stands.
        self._on_leg = there if math.isfinite(there) else before
        return before - self._on_leg

    def judge(self, truth: Mapping[str, Any], *, stopped: bool, out_of_time: bool) -> str:
        """The outcome of a step in which the robot stopped, or did not."""
        if truth["collision"]:
            return COLLISION
        if stopped:
            return self._judge_stop()
        return TIMEOUT if out_of_time else RUNNING

    def said(self, outcome: str, believed_distance: float) -> dict[str, Any]:
        """What `info` says beside the robot's own."""
        return {
            "outcome": outcome,
            "is_success": outcome == SUCCESS,
            "goals_reached": self._reached,
            "distance_to_goal": self.distance,
            "believed_distance_to_goal": believed_distance,
            "path_length": self.path_length,
            "shortest_path": self.shortest_path,
            "progress": 1 - self.remaining_path / sum(self._legs),
        }

    @property
    def _is_done(self) -> bool:
        return self._reached == len(self._goals)

    def _judge_stop(self) -> str:
        if self.distance > SUCCESS_RADIUS:
            return MISSED
        self._reached += 1
        if self._is_done:
            return SUCCESS
        self._on_leg = self._ways[self._reached].length(self._in_world(self._position))
        return REACHED

    def _in_world(self, place: Array) -> Array:
        """(2,) m, a place of the frame of the start in the frame of the world."""
        return np.asarray(compose(self._start, [*place, 0.0])[:2])
