"""Drives that fit a world: a way through its goals, planned on its map, or a plane's own course.

On a tour an operator steers who sees where the robot is. Only the operator does: what is kept of
the drive is its actions, and all estimators watch those.
"""

from collections.abc import Iterator
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
    """The actions of an operator in the world of this seed, for so many steps, or until a plane's
    course is done: through a world's goals, back through them, and so on.

    Args:
        scout: the environment of the comparison, without sensors.
    """
    _, info = scout.reset(seed=seed)
    actions: list[Array] = []
    for driver in _operators(scout, info):
        before = len(actions)
        while len(actions) < steps and (action := driver(_seen(info))) is not None:
            actions.append(action)
            *_, info = scout.step(action.astype(np.float32))
        # A way that is no longer than the robot's reach is done without a step, for ever.
        if len(actions) in (steps, before):
            break
    return lambda step: actions[step] if step < len(actions) else None


def _operators(scout: Env, info: dict[str, Any]) -> Iterator[ClosedLoop]:
    """One for each way, in turn."""
    world, rig = scout.get_wrapper_attr("world"), scout.get_wrapper_attr("rig")
    if isinstance(world, PlaneWorld):
        yield SteeringDriver(rig, world.course)
        return
    way = _waypoints(scout, info)
    while True:
        yield WaypointDriver(rig, way, arrival_radius=_ARRIVAL_RADIUS)
        way = way[::-1]


def waypoint_driver(scout: Env, seed: int) -> WaypointDriver:
    """A driver that trusts an estimate: through a square where the world of this seed has the room
    for it, and through the world's goals elsewhere."""
    _, info = scout.reset(seed=seed)
    if scout.get_wrapper_attr("world").clear_radius > _ROOM_FOR_SQUARE:
        return WaypointDriver(scout.get_wrapper_attr("rig"))
    return WaypointDriver(
        scout.get_wrapper_attr("rig"), _waypoints(scout, info), arrival_radius=_ARRIVAL_RADIUS
    )


def _waypoints(env: Env, info: dict[str, Any]) -> Array:
    """(n, 2) m, in the frame of the start."""
    in_world = plan_tour(env.get_wrapper_attr("world"))
    poses = np.column_stack([in_world, np.zeros(len(in_world))])
    return np.asarray(between(info["start_pose"], poses)[:, :2])


def _seen(info: dict[str, Any]) -> PoseEstimate:
    return PoseEstimate(info["true_pose"], np.zeros((3, 3)), Status.TRACKING, 0.0)
