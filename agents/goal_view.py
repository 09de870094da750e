"""What a policy sees of the goal task: beams, the goal as the robot believes it, what it did."""

import math
from collections.abc import Iterable
from numbers import Integral
from typing import Any, Final

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from grouser.estimators.base import PoseEstimate
from grouser.geometry import Array
from grouser.rig import Rig

POLICY_SENSORS: Final = ("lidar", "left", "right")
"""Sensors that a policy can see."""

_DISTANCE_UNIT = 10.0  # m, of a normalised distance
_FARTHEST = 1e6  # m; finite, because Gymnasium's checker asks for it
_VARIANCE = 1e12
_UPPER = np.triu_indices(3)


class GoalView:
    """Makes a policy's observations out of a robot's observations and estimates.

    Args:
        rig: the robot's calibration.
        shown: the robot's observation space.
        sensors: of POLICY_SENSORS; what the policy sees beside the goal.
        beams: into how many equal sectors the lidar's beams are gathered, each as its nearest.
        normalize: beams as a fraction of the longest range and distances in units of 10 m, instead
            of metres.
        covariance: show the estimate's covariance too.

    Raises:
        ValueError: more beams than the lidar has, or fewer than one.
    """

    def __init__(
        self,
        rig: Rig,
        shown: spaces.Dict,
        *,
        sensors: tuple[str, ...],
        beams: int,
        normalize: bool,
        covariance: bool,
    ) -> None:
        self._sensors, self._normalize, self._covariance = sensors, normalize, covariance
        bounds = (1.0, _FARTHEST / _DISTANCE_UNIT) if normalize else (None, _FARTHEST)
        parts: dict[str, spaces.Space[Any]] = {key: shown[key] for key in sensors if key != "lidar"}
        if "lidar" in sensors:
            assert rig.lidar is not None
            self._edges = _sectors(beams, rig.lidar.n_beams)
            self._longest = rig.lidar.range_max
            high = bounds[0] or self._longest
            parts["beams"] = spaces.Box(0.0, high, (beams,), np.float32)
        parts["goal"] = spaces.Box(
            np.array([0, -1, -1], dtype=np.float32),
            np.array([bounds[1], 1, 1], dtype=np.float32),
            dtype=np.float32,
        )
        parts["last_action"] = spaces.Box(-1.0, 1.0, (2,), np.float32)
        if covariance:
            parts["pose_covariance"] = spaces.Box(-_VARIANCE, _VARIANCE, (6,), np.float32)
        self.space = spaces.Dict(parts)

    def of(
        self, shown: dict[str, Any], estimate: PoseEstimate, goal: Array, last_action: Array
    ) -> dict[str, NDArray[Any]]:
        """The observation: all of it new memory.

        Args:
            shown: what the robot's sensors show.
            estimate: the pose as the robot believes it.
            goal: (2,) m, in the frame of the start.
            last_action: (2,) the tracks' speeds that were last asked for.
        """
        parts = {key: shown[key].copy() for key in self._sensors if key != "lidar"}
        if "lidar" in self._sensors:
            parts["beams"] = self._beams(shown["lidar"])
        parts["goal"] = self._goal(estimate.pose, goal)
        parts["last_action"] = np.array(last_action, dtype=np.float32)
        if self._covariance:
            upper = estimate.covariance[_UPPER]
            parts["pose_covariance"] = np.clip(upper, -_VARIANCE, _VARIANCE).astype(np.float32)
        return parts

    def _beams(self, ranges: NDArray[np.float32]) -> NDArray[np.float32]:
        nearest = np.minimum(np.minimum.reduceat(ranges, self._edges), self._longest)
        return np.asarray(nearest / self._longest if self._normalize else nearest, dtype=np.float32)

    def _goal(self, pose: Array, goal: Array) -> NDArray[np.float32]:
        distance, bearing = believed_goal(pose, goal)
        unit = _DISTANCE_UNIT if self._normalize else 1.0
        values = [min(distance, _FARTHEST) / unit, math.cos(bearing), math.sin(bearing)]
        return np.array(values, dtype=np.float32)


def believed_goal(pose: Array, goal: Array) -> tuple[float, float]:
    """Distance [m] and bearing [rad, left positive] of a goal (2,) from a pose (3,)."""
    (x, y, heading), (goal_x, goal_y) = pose.tolist(), goal.tolist()
    dx, dy, c, s = goal_x - x, goal_y - y, math.cos(heading), math.sin(heading)
    return math.hypot(dx, dy), math.atan2(c * dy - s * dx, c * dx + s * dy)


def known_policy_sensors(names: Iterable[str]) -> tuple[str, ...]:
    """Sensors that a policy can see, in the order of POLICY_SENSORS.

    Raises:
        ValueError: one of the names is none of them.
    """
    listed = (names,) if isinstance(names, str) else tuple(names)
    unknown = [name for name in listed if name not in POLICY_SENSORS]
    if unknown:
        raise ValueError(
            f"a policy cannot see {unknown[0]!r}; policy_sensors are of: "
            f"{', '.join(POLICY_SENSORS)}"
        )
    return tuple(name for name in POLICY_SENSORS if name in listed)


def _sectors(beams: int, n_beams: int) -> NDArray[np.int64]:
    """The first beam of every sector."""
    if not (isinstance(beams, Integral) and 1 <= beams <= n_beams):
        raise ValueError(
            f"beams must be a whole number from 1 to the lidar's own {n_beams}, got {beams!r}"
        )
    return np.arange(beams) * n_beams // beams
