"""The truth in the form of an estimate: what every other estimator is measured against."""

from typing import ClassVar

import numpy as np

from grouser.estimators.base import Observation, PoseEstimate, PoseEstimator, Status
from grouser.geometry import between, inverse_transform
from grouser.rig import Rig


class GroundTruth(PoseEstimator):
    """Repeats the true pose that the environment tells in `info`, in the frame of the first one.

    It may: the registry gives the truth to this name, to emulated, and to no other.
    """

    requires: ClassVar[frozenset[str]] = frozenset({"true_pose", "true_pose_3d", "stamp"})

    def __init__(self, rig: Rig) -> None:
        self._T_start_world = np.eye(4)
        self._start = np.zeros(3)

    def reset(self, observation: Observation, *, rng: np.random.Generator) -> PoseEstimate:
        """Take the present pose for the frame of all that follow."""
        self._start = np.array(observation["true_pose"], dtype=np.float64)
        self._T_start_world = inverse_transform(observation["true_pose_3d"])
        return self.update(observation)

    def update(self, observation: Observation) -> PoseEstimate:
        """The pose at this stamp, known exactly."""
        return PoseEstimate(
            pose=between(self._start, observation["true_pose"]),
            covariance=np.zeros((3, 3)),
            status=Status.TRACKING,
            stamp=float(observation["stamp"][0]),
            pose_3d=self._T_start_world @ observation["true_pose_3d"],
        )
