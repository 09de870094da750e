"""The motion model as a predictor on the plane: it leads from a late image on to now."""

import numpy as np

from grouser.estimators.base import Observation
from grouser.estimators.monocular.motion_model import Motion, TrackModel
from grouser.estimators.visual.constant_errors import ConstantErrors
from grouser.estimators.visual.planar_motion import planar_pose, pose_motion
from grouser.estimators.visual.prediction import Increment, MotionPredictor
from grouser.geometry import Array

_PLANAR = slice(0, 3)


class TrackModelPredictor(MotionPredictor):
    """The tracks measure the increment; where they are silent it is expected to come again."""

    measures = True

    def __init__(self, model: TrackModel, errors: ConstantErrors) -> None:
        """errors: of the model, five of them."""
        self.errors = errors
        self._model = model
        self._last = np.zeros(6)

    def predict(self, observation: Observation, biases: Array) -> Increment:
        du = np.asarray(observation["tracks"], dtype=np.float64)
        if np.isfinite(du).all():
            return _increment(self._model.predict(du, biases), measured=True)
        return _increment(self._model.expect_again(self._last), measured=False)

    def learn(self, increment: Array | None) -> None:
        planar = np.zeros(3) if increment is None else pose_motion(increment)
        self._last = np.append(planar, np.zeros(3))

    def tell(self, biases: Array, covariance: Array) -> dict[str, float]:
        return {}


def _increment(motion: Motion, *, measured: bool) -> Increment:
    pose, to_pose = planar_pose(motion.mean)
    covariance = to_pose @ motion.covariance[_PLANAR, _PLANAR] @ to_pose.T
    return Increment(pose, covariance, to_pose @ motion.by_constants[_PLANAR], measured)
