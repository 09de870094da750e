"""The increments of another estimator as a prediction, as sure as it is of them."""

import numpy as np

from grouser.estimators.base import Observation, PoseEstimator, Status, check_observation_keys
from grouser.estimators.pose_source import relative_covariance
from grouser.estimators.visual.constant_errors import NO_ERRORS
from grouser.estimators.visual.prediction import Increment, MotionPredictor
from grouser.geometry import Array, between


class SourcePredictor(MotionPredictor):
    """What the source adds to its pose in a step, and to its covariance.

    Where it is LOST its increments are no measurement.
    """

    measures = True
    errors = NO_ERRORS

    def __init__(
        self, source: PoseEstimator, observation: Observation, rng: np.random.Generator
    ) -> None:
        """Raises:
        ValueError: the first observation lacks what the source requires.
        """
        check_observation_keys(source, observation)
        self._source = source
        self._now = source.reset(observation, rng=rng)

    def predict(self, observation: Observation, biases: Array) -> Increment:
        before, self._now = self._now, self._source.update(observation)
        pose = between(before.pose, self._now.pose)
        covariance = relative_covariance(before, self._now, pose)
        return Increment(
            pose, covariance, np.zeros((3, 0)), measured=self._now.status is not Status.LOST
        )

    def learn(self, increment: Array | None) -> None:
        """The source learns by itself."""

    def tell(self, biases: Array, covariance: Array) -> dict[str, float]:
        return {}
