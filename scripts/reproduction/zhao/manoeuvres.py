"""How the robot is driven: by an operator who sees where it is and knows the world."""

import math
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from grouser.agents.scripted import TOP_SPEED, track_action
from grouser.agents.tour import SPACING, plan_tour
from grouser.agents.waypoints import WaypointDriver
from grouser.envs.tracked_robot import TrackedRobotEnv
from grouser.estimators.base import PoseEstimate, Status
from grouser.geometry import Array, between

Operator = Callable[[int, dict[str, Any]], Array]
"""Step and `info` to the action (2,)."""


class Manoeuvre(ABC):
    """A kind of course."""

    @abstractmethod
    def operator(self, env: TrackedRobotEnv, info: dict[str, Any], frames: int) -> Operator:
        """Who drives so many frames from where the robot stands after a reset."""


@dataclass(frozen=True, slots=True)
class ThereAndBack(Manoeuvre):
    """Straight on for half of the frames, and back in reverse."""

    speed: float
    """m/s"""

    def operator(self, env: TrackedRobotEnv, info: dict[str, Any], frames: int) -> Operator:
        action = track_action(env.rig, self.speed, 0.0, top_speed=TOP_SPEED)
        return lambda step, _: action if step < frames // 2 else -action


@dataclass(frozen=True, slots=True)
class SpotTurn(Manoeuvre):
    """Turns to the left on the spot, all at one rate."""

    turns: float

    def operator(self, env: TrackedRobotEnv, info: dict[str, Any], frames: int) -> Operator:
        rate = 2 * math.pi * self.turns / (frames * env.rig.dt)
        action = track_action(env.rig, 0.0, rate, top_speed=TOP_SPEED)
        return lambda step, _: action


@dataclass(frozen=True, slots=True)
class Circle(Manoeuvre):
    """To the left at one speed and radius."""

    speed: float
    """m/s"""
    radius: float
    """m"""

    def operator(self, env: TrackedRobotEnv, info: dict[str, Any], frames: int) -> Operator:
        action = track_action(env.rig, self.speed, self.speed / self.radius, top_speed=TOP_SPEED)
        return lambda step, _: action


@dataclass(frozen=True, slots=True)
class Tour(Manoeuvre):
    """Through the world's goals on ways that are free, and back again, as often as there is time
    for it; at 0.36 m/s, slower in curves."""

    def operator(self, env: TrackedRobotEnv, info: dict[str, Any], frames: int) -> Operator:
        way = plan_tour(env.world)
        poses = np.column_stack([way, np.zeros(len(way))])
        there = np.asarray(between(info["start_pose"], poses)[:, :2])
        round_trip = np.concatenate([there, there[-2::-1]])
        longest = TOP_SPEED * env.rig.dt * frames
        times = math.ceil(longest / (SPACING * len(round_trip))) + 1
        driver = WaypointDriver(
            env.rig, np.tile(round_trip, (times, 1)), arrival_radius=_ARRIVAL_RADIUS
        )

        def drive(_: int, told: dict[str, Any]) -> Array:
            seen = PoseEstimate(told["true_pose"], np.zeros((3, 3)), Status.TRACKING, 0.0)
            action = driver(seen)
            assert action is not None  # the way is longer than the robot could drive
            return action

        return drive


_ARRIVAL_RADIUS = 0.3  # m; the way's waypoints are SPACING apart
