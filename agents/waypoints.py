"""Driving through waypoints on the estimated pose, as a robot without a positioning system must."""

import math
from collections.abc import Sequence

import numpy as np

from grouser.agents.scripted import TOP_SPEED, track_action
from grouser.estimators.base import PoseEstimate, Status
from grouser.geometry import Array, wrap
from grouser.rig import Rig

SQUARE: tuple[tuple[float, float], ...] = ((2.0, 0.0), (2.0, 2.0), (0.0, 2.0), (0.0, 0.0))
"""m, in the frame of the start."""

ARRIVAL_RADIUS = 0.15
"""m"""

_CRUISE_SPEED = 0.36
_TURN_RATE = 0.5
_TURN_GAIN = 1.5
# Beyond this bearing [rad] the robot turns on the spot; an arc would swing wide of the waypoint.
_SPOT_TURN_BEARING = math.radians(50)


class WaypointDriver:
    """Goes from waypoint to waypoint; call it with each estimate for the action of that step."""

    def __init__(
        self,
        rig: Rig,
        waypoints: Sequence[tuple[float, float]] | Array = SQUARE,
        *,
        arrival_radius: float = ARRIVAL_RADIUS,
        top_speed: float = TOP_SPEED,
    ) -> None:
        """Drive the robot of `rig` through `waypoints` [m, in the frame of the start].

        Raises:
            ValueError: no waypoint, one that is not two finite numbers, or a radius that is not
                positive.
        """
        if len(waypoints) == 0 or not arrival_radius > 0:
            raise ValueError(
                "a waypoint driver needs at least one waypoint and a positive arrival radius; "
                f"got {len(waypoints)} and {arrival_radius}"
            )
        self.waypoints = np.array(waypoints, dtype=np.float64)
        if self.waypoints.shape != (len(waypoints), 2) or not np.isfinite(self.waypoints).all():
            raise ValueError(f"a waypoint must be two finite numbers x, y [m]; got {waypoints}")
        self.targets: list[int] = []
        """Index of the waypoint that was driven to in each step so far; their number at the end."""
        self._rig, self._radius, self._top_speed = rig, arrival_radius, top_speed

    def __call__(self, estimate: PoseEstimate) -> Array | None:
        """The action (2,), or None when the last waypoint is reached as far as the robot knows."""
        target = self.targets[-1] if self.targets else 0
        # A lost robot cannot tell whether it arrived.
        if estimate.status is not Status.LOST and self._arrived(estimate.pose, target):
            target += 1
        self.targets.append(target)
        if target == len(self.waypoints):
            return None
        return action_toward(estimate, self.waypoints[target], self._rig, top_speed=self._top_speed)

    def _arrived(self, pose: Array, target: int) -> bool:
        return float(np.linalg.norm(self.waypoints[target] - pose[:2])) < self._radius


def action_toward(
    estimate: PoseEstimate, waypoint: Array, rig: Rig, *, top_speed: float = TOP_SPEED
) -> Array:
    """The action (2,) that brings the robot nearer to a waypoint (2,) [m, frame of the start].

    It turns on the spot toward a waypoint beside or behind it, and drives an arc to one ahead. A
    robot that is LOST stands still, for it might drive into anything.
    """
    if estimate.status is Status.LOST:
        return np.zeros(2)
    x, y, heading = estimate.pose
    bearing = float(wrap(math.atan2(waypoint[1] - y, waypoint[0] - x) - heading))
    turn_rate = float(np.clip(_TURN_GAIN * bearing, -_TURN_RATE, _TURN_RATE))
    speed = 0.0 if abs(bearing) > _SPOT_TURN_BEARING else _CRUISE_SPEED * math.cos(bearing)
    return track_action(rig, speed, turn_rate, top_speed=top_speed)


def waypoint_misses(waypoints: Array, true_poses: Array, targets: Sequence[int]) -> list[float]:
    """How near the robot truly came to each waypoint (W, 2), m.

    Counted from the frame in which it set out for that waypoint, for a course that passes one
    early would flatter it otherwise; a waypoint that it never set out for counts from the last
    frame. Poses (N, 3) are true, targets are `WaypointDriver.targets`.
    """
    misses = []
    for index, waypoint in enumerate(waypoints):
        began = next((k for k, target in enumerate(targets) if target >= index), -1)
        away = np.linalg.norm(true_poses[began:, :2] - waypoint, axis=1)
        misses.append(float(away.min()))
    return misses
