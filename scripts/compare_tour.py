"""A drive through the goals of a world, steered by an operator who sees where the robot is.

Only the operator does: what is kept of the drive is its actions, and all estimators watch those.
"""

from typing import Any

import numpy as np

from grouser.agents.tour import plan_tour
from grouser.agents.waypoints import WaypointDriver
from grouser.estimators.base import PoseEstimate, Status
from grouser.estimators.evaluation.comparison import OpenLoop
from grouser.geometry import Array, between
from grouser.scripts.compare_source import Env

_ARRIVAL_RADIUS = 0.3
"""m; a way's waypoints are 0.4 m apart, and a corner is cut by less than the robot keeps away."""


def tour(env: Env, seed: int, steps: int) -> OpenLoop:
    """The actions of an operator in the world of this seed, for at most so many steps.

    Args:
        env: the same environment as that of the comparison; its sensors do not matter.
    """
    _, info = env.reset(seed=seed)
    driver = WaypointDriver(
        env.get_wrapper_attr("rig"), _waypoints(env, info), arrival_radius=_ARRIVAL_RADIUS
    )
    actions: list[Array] = []
    while len(actions) < steps:
        action = driver(_seen(info))
        if action is None:
            break
        actions.append(action)
        *_, info = env.step(action.astype(np.float32))
    return lambda step: actions[step] if step < len(actions) else None


def _waypoints(env: Env, info: dict[str, Any]) -> Array:
    """(n, 2) m, in the frame of the start."""
    in_world = plan_tour(env.get_wrapper_attr("world"))
    poses = np.column_stack([in_world, np.zeros(len(in_world))])
    return np.asarray(between(info["start_pose"], poses)[:, :2])


def _seen(info: dict[str, Any]) -> PoseEstimate:
    return PoseEstimate(info["true_pose"], np.zeros((3, 3)), Status.TRACKING, 0.0)
