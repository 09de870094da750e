"""Where eq. (5) alone leads: the way by the reported steering, by nobody corrected."""

from typing import ClassVar

import numpy as np

from grouser.estimators.base import Observation, PoseEstimate, PoseEstimator, Status
from grouser.estimators.line_slam.ackermann import AckermannPredictor
from grouser.estimators.line_slam.motion import PredictedMotion
from grouser.rig import Rig


class SteeringReckoning(PoseEstimator):
    """Adds up increments, and their covariances."""

    requires: ClassVar[frozenset[str]] = frozenset({"stamp", "steering"})

    def __init__(self, rig: Rig) -> None:
        """Of a rig that steers."""
        assert rig.steering is not None
        self._motion = PredictedMotion(AckermannPredictor(rig.steering, rig.dt))

    def reset(self, observation: Observation, *, rng: np.random.Generator) -> PoseEstimate:
        self._pose, self._P = np.zeros(3), np.zeros((3, 3))
        return self._estimate(observation)

    def update(self, observation: Observation) -> PoseEstimate:
        step = self._motion.predict(observation, self._pose, np.zeros(0))
        self._pose = step.pose
        self._P = step.by_pose @ self._P @ step.by_pose.T + step.covariance
        return self._estimate(observation)

    def _estimate(self, observation: Observation) -> PoseEstimate:
        stamp = float(observation["stamp"][0])
        return PoseEstimate(self._pose.copy(), self._P.copy(), Status.COASTING, stamp)
