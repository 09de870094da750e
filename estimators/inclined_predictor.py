"""Where no tracks drive: another's prediction, by which the inclination is followed."""

from grouser.estimators.base import Observation
from grouser.estimators.inclination import Inclination
from grouser.estimators.visual.prediction import Increment, MotionPredictor
from grouser.geometry import Array


class InclinedPredictor(MotionPredictor):
    """Predicts as another does; what that says of the motion the accelerometer need not explain."""

    def __init__(self, inner: MotionPredictor, inclination: Inclination) -> None:
        """inclination: is followed here; others may read it after `predict`."""
        self._inner, self._inclination = inner, inclination
        self.errors, self.measures = inner.errors, inner.measures

    def predict(self, observation: Observation, biases: Array) -> Increment:
        increment = self._inner.predict(observation, biases)
        self._inclination.follow(observation, increment.pose)
        return increment

    def learn(self, increment: Array | None) -> None:
        self._inner.learn(increment)

    def tell(self, biases: Array, covariance: Array) -> dict[str, float]:
        return self._inner.tell(biases, covariance)
