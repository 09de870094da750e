"""Keeps the scans of a drive, to draw afterwards what a lidar saw."""

from typing import Any

import gymnasium as gym
import numpy as np

from grouser.geometry import Array, compose, project
from grouser.rig import Lidar

_MOST = 400
"""Scans that are drawn of a drive; so many show every wall."""


class ScanKeeper(gym.Wrapper[Any, Any, Any, Any]):
    """Changes nothing; `points` puts what the lidar hit since the last `reset` on the plane."""

    def __init__(self, env: gym.Env[Any, Any]) -> None:
        super().__init__(env)
        self._frame = 0
        self._scans: list[tuple[int, Array]] = []

    def reset(self, **options: Any) -> tuple[Any, dict[str, Any]]:
        observation, info = self.env.reset(**options)
        self._frame, self._scans = 0, []
        self._keep(observation)
        return observation, info

    def step(self, action: Any) -> tuple[Any, Any, bool, bool, dict[str, Any]]:
        observation, *rest = self.env.step(action)
        self._frame += 1
        self._keep(observation)
        return (observation, *rest)

    def points(self, poses: Array) -> Array:
        """(k, 2) m, with the robot's pose (N, 3) in each frame since the reset."""
        lidar: Lidar | None = self.get_wrapper_attr("rig").lidar
        if lidar is None or not self._scans:
            return np.zeros((0, 2))
        some = self._scans[:: -(-len(self._scans) // _MOST)]
        return np.concatenate([_hits(lidar, scan, poses[frame]) for frame, scan in some])

    def _keep(self, observation: Any) -> None:
        """A scan of this very frame; in between, a slow lidar shows its last one again."""
        if "lidar" not in observation:
            return
        stamp = observation["stamp"]
        if np.array_equal(observation.get("lidar_stamp", stamp), stamp):
            self._scans.append((self._frame, observation["lidar"].copy()))


def _hits(lidar: Lidar, scan: Array, pose: Array) -> Array:
    hit = (scan > lidar.range_min) & (scan < lidar.range_max)
    bearings = lidar.bearings[hit]
    at = scan[hit] * np.array([np.cos(bearings), np.sin(bearings)])
    in_base = compose(project(lidar.T_base_lidar), np.column_stack([at.T, np.zeros(hit.sum())]))
    return np.asarray(compose(pose, in_base)[:, :2])
