"""A classical driver without a map: the dynamic window approach on the lidar.

Fox, Burgard, Thrun: The dynamic window approach to collision avoidance, 1997.
"""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from grouser.agents.driver import Action, Driver
from grouser.agents.goal_view import believed_goal
from grouser.agents.scripted import TOP_SPEED, track_action
from grouser.envs.simulation.robot_model import RobotModel
from grouser.envs.simulation.world import World
from grouser.estimators.base import PoseEstimate, Status
from grouser.geometry import Array
from grouser.kernels import kernel
from grouser.rig import Lidar, Rig

_SPEEDS = np.linspace(0.0, 0.4, 9)  # m/s
_TURN_RATES = np.linspace(-0.8, 0.8, 17)  # rad/s, left positive
_STEP, _STEPS = 0.15, 16  # s, and how many of them an arc is followed for
_KEEP = 0.06
"""Between hull and obstacle, m; an arc that comes nearer is not driven."""
_WIDE = 0.6
"""Room beyond this counts no more, m."""
_PROGRESS, _CLEARANCE, _SPEED = 1.0, 0.25, 0.05
"""Weights of the objective's terms: Fox et al., eq. (13), with progress towards the goal in metres
instead of heading, which a goal nearby would make jump."""
_HULL = np.array([RobotModel().length, RobotModel().hull_width]) / 2


class DynamicWindow(Driver):
    """Of the arcs that the robot can drive in the next seconds and that keep clear of what the
    lidar sees, takes the one that brings it nearest to the believed goal, with room and speed.

    It knows no map: dead ends hold it, and it drives into what is lower than the lidar. A robot
    that is LOST stands still.
    """

    task: Mapping[str, Any] = {"policy_sensors": ("lidar",), "beams": 360, "normalize": False}

    def reset(self, rig: Rig, world: World) -> None:
        """A new episode; the world is not looked at.

        Raises:
            ValueError: the rig has no lidar.
        """
        if rig.lidar is None:
            raise ValueError("dynamic-window looks at the lidar, and this rig has none")
        self._rig, self._rays = rig, _rays(rig.lidar)
        self._mount, self._range_max = rig.lidar.T_base_lidar[:2, 3], rig.lidar.range_max

    def action(
        self, observation: Mapping[str, NDArray[Any]], believed: PoseEstimate, goal: Array
    ) -> Action:
        """The best arc's track speeds, or at rest."""
        if believed.status is Status.LOST:
            return np.zeros(2, dtype=np.float32)
        distance, bearing = believed_goal(believed.pose, goal)
        ahead = distance * np.array([math.cos(bearing), math.sin(bearing)])
        seen = self._points(observation["beams"].astype(np.float64))
        speed, turn_rate = _best(seen, ahead)
        return track_action(self._rig, speed, turn_rate, top_speed=TOP_SPEED).astype(np.float32)

    def _points(self, ranges: Array) -> Array:
        """(n, 2) what the lidar sees within reach, robot frame, m."""
        reach = float(_SPEEDS[-1]) * _STEP * _STEPS + float(np.hypot(*_HULL)) + _WIDE
        near = ranges < min(reach, self._range_max)
        return np.asarray(self._rays[near] * ranges[near, None] + self._mount)


def _best(seen: Array, goal: Array) -> tuple[float, float]:
    """Speed [m/s] and turn rate [rad/s] of the best arc among those that are clear."""
    nearest, room = _follow(seen, goal, _SPEEDS, _TURN_RATES, _STEP, _STEPS, _HULL)
    score = (
        _PROGRESS * -nearest
        + _CLEARANCE * np.minimum(room / _WIDE, 1)
        + _SPEED * (_SPEEDS / _SPEEDS[-1])[:, None]
    )
    # The first speed is none: turning on the spot is always allowed.
    score[1:][room[1:] < _KEEP] = -math.inf
    row, column = np.unravel_index(int(np.argmax(score)), score.shape)
    return float(_SPEEDS[row]), float(_TURN_RATES[column])


def _rays(lidar: Lidar) -> Array:
    """(n, 2) directions of the beams on the plane, robot frame."""
    angles = lidar.angle_min + lidar.angle_increment * np.arange(lidar.n_beams)
    return np.asarray(
        np.column_stack([np.cos(angles), np.sin(angles)]) @ lidar.T_base_lidar[:2, :2].T
    )


@kernel
def _follow(
    seen: Any, goal: Any, speeds: Any, turn_rates: Any, step: float, steps: int, hull: Any
) -> Any:
    """Of every arc (speeds, turn rates): how near it comes to the goal, and the least room between
    the hull and what is seen, m."""
    shape = (speeds.shape[0], turn_rates.shape[0])
    nearest, room = np.empty(shape), np.empty(shape)
    for i in range(shape[0]):
        for j in range(shape[1]):
            x, y, heading = 0.0, 0.0, 0.0
            best, least = np.hypot(goal[0], goal[1]), np.inf
            for _ in range(steps):
                x += speeds[i] * step * np.cos(heading + turn_rates[j] * step / 2)
                y += speeds[i] * step * np.sin(heading + turn_rates[j] * step / 2)
                heading += turn_rates[j] * step
                least = min(least, _gap(seen, x, y, heading, hull))
                best = min(best, np.hypot(goal[0] - x, goal[1] - y))
            nearest[i, j], room[i, j] = best, least
    return nearest, room


@kernel
def _gap(seen: Any, x: float, y: float, heading: float, hull: Any) -> float:
    """From the hull at a pose to the nearest point that is seen, m; 0 within it."""
    c, s = np.cos(heading), np.sin(heading)
    least = np.inf
    for k in range(seen.shape[0]):
        dx, dy = seen[k, 0] - x, seen[k, 1] - y
        ahead = max(0.0, abs(c * dx + s * dy) - hull[0])
        beside = max(0.0, abs(c * dy - s * dx) - hull[1])
        least = min(least, np.hypot(ahead, beside))
    return least
