"""What truly happened in a step, for scoring: the tracked robot's `info`."""

from collections.abc import Mapping
from typing import Any

from grouser.envs.simulation.motion import Motion, instantaneous_centres, longitudinal_slip
from grouser.geometry import Array, inverse_transform, project

TRUTH: Mapping[str, tuple[type, tuple[int, ...]]] = {
    "true_pose": (float, (3,)),
    "true_pose_3d": (float, (4, 4)),
    "true_twist": (float, (3,)),
    "track_speed": (float, (2,)),
    "slip": (float, (2,)),
    "icr": (float, (3,)),
    "effective_width": (float, ()),
    "contacts": (int, ()),
    "collision": (bool, ()),
    "start_pose": (float, (3,)),
}
"""Type and shape of every entry; `TrackedRobotEnv` says what they mean."""


class Truth:
    """Tells motions in the frame of the start.

    Args:
        T_world_start: (4, 4) pose of the robot at the start.
        gauge: distance between the middles of the tracks, m.
    """

    def __init__(self, T_world_start: Array, *, gauge: float) -> None:
        self._T_start_world = inverse_transform(T_world_start)
        self._start_pose = project(T_world_start)
        self._gauge = gauge

    def of(self, motion: Motion) -> dict[str, Any]:
        """The truth after a motion, all of it new memory; the entries are those of TRUTH."""
        T_start_base = self._T_start_world @ motion.T_world_base
        icr = instantaneous_centres(motion)
        return {
            "true_pose": project(T_start_base),
            "true_pose_3d": T_start_base,
            "true_twist": motion.twist.copy(),
            "track_speed": motion.track_speed.copy(),
            "slip": longitudinal_slip(motion, self._gauge),
            "icr": icr,
            "effective_width": float(icr[0] - icr[1]),
            "contacts": motion.contacts,
            "collision": motion.collision,
            "start_pose": self._start_pose.copy(),
        }
