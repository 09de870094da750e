"""Drives that fit a world: a way through its goals, planned on its map, or a plane's own course.

On a tour an operator steers who sees where the robot is. Only the operator does: what is kept of
the drive is its actions, and all estimators watch those.
"""

from typing import Any

import numpy as np

from grouser.agents.steering import SteeringDriver
from grouser.agents.tour import plan_tour
from grouser.agents.waypoints import SQUARE, WaypointDriver
from grouser.envs.plane.world import PlaneWorld
from grouser.estimators.base import PoseEstimate, Status
from grouser.estimators.evaluation.comparison import ClosedLoop, OpenLoop
from grouser.geometry import Array, between
from grouser.scripts.compare_source import Env

_ARRIVAL_RADIUS = 0.3
"""m; a way's waypoints are 0.4 m apart, and a corner is cut by less than the robot keeps away."""

_ROOM_FOR_SQUARE = float(np.linalg.norm(SQUARE, axis=1).max())
"""m, from the start"""


def tour(scout: Env, seed: int, steps: int) -> OpenLoop:
    """The actions of an operator in the world of this seed, for at most so many steps.

    Args:
        scout: the environment of the comparison, without sensors.
    """
    _, info = scout.reset(seed=seed)
    driver = _operator(scout, info)
    actions: list[Array] = []
    while len(actions) < steps:
        action = driver(_seen(info))
        if action is None:
            break
        actions.append(action)
        *_, info = scout.step(action.astype(np.float32))
    return lambda step: actions[step] if step < len(actions) else None


def _operator(scout: Env, info: dict[str, Any]) -> ClosedLoop:
    world = scout.get_wrapper_attr("world")
    if isinstance(world, PlaneWorld):
        return SteeringDriver(scout.get_wrapper_attr("rig"), world.course)
    return _through_the_goals(scout, info)


def waypoint_driver(scout: Env, seed: int) -> WaypointDriver:
    """A driver that trusts an estimate: through a square where the world of this seed has the room
    for it, and through the world's goals elsewhere."""
    _, info = scout.reset(seed=seed)
    if scout.get_wrapper_attr("world").clear_radius > _ROOM_FOR_SQUARE:
        return WaypointDriver(scout.get_wrapper_attr("rig"))
    return _through_the_goals(scout, info)


def _through_the_goals(env: Env, info: dict[str, Any]) -> WaypointDriver:
    return WaypointDriver(
        env.get_wrapper_attr("rig"), _waypoints(env, info), arrival_radius=_ARRIVAL_RADIUS
    )


def _waypoints(env: Env, info: dict[str, Any]) -> Array:
    """(n, 2) m, in the frame of the start."""
    in_world = plan_tour(env.get_wrapper_attr("world"))
    poses = np.column_stack([in_world, np.zeros(len(in_world))])
    return np.asarray(between(info["start_pose"], poses)[:, :2])


def _seen(info: dict[str, Any]) -> PoseEstimate:
    return PoseEstimate(info["true_pose"], np.zeros((3, 3)), Status.TRACKING, 0.0)
