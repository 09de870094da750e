"""Where nothing measures the increment: the robot goes on as it went, and how much it may not."""

import numpy as np

from grouser.checks import require_positive
from grouser.estimators.base import Observation
from grouser.estimators.icr_motion import exp_jacobian
from grouser.estimators.track_motion import SideSlip
from grouser.estimators.visual.constant_errors import ConstantErrors
from grouser.estimators.visual.prediction import Increment, MotionPredictor
from grouser.geometry import Array, exp


class CruisePredictor(MotionPredictor):
    """Forward speed and turn rate are errors of a prediction that stands still, and wander.

    So the filter estimates them from whatever it sees, as a motion of nearly constant velocity;
    when it sees nothing, they grow uncertain, and the pose with them.
    """

    measures = False

    def __init__(
        self,
        dt: float,
        *,
        fastest: float = 15.0,
        turn_rate: float = 1.0,
        acceleration: float = 1.0,
        turn_acceleration: float = 2.0,
    ) -> None:
        """
        Args:
            dt: between two observations, s.
            fastest: one sigma of the forward speed at the start, m/s.
            turn_rate: one sigma of the turn rate at the start, rad/s.
            acceleration: one sigma of what the speed changes, m/s^2.
            turn_acceleration: one sigma of what the turn rate changes, rad/s^2.

        Raises:
            ValueError: one of them is not positive.
        """
        self._fastest, self._turn_rate = fastest, turn_rate
        self._acceleration, self._turn_acceleration = acceleration, turn_acceleration
        require_positive(self, "_fastest", "_turn_rate", "_acceleration", "_turn_acceleration")
        self.errors = ConstantErrors(
            ("forward speed [m/frame]", "turn rate [rad/frame]"),
            np.array([fastest, turn_rate]) * dt,
            np.array([acceleration, turn_acceleration]) * dt**2,
        )
        self._side_slip = SideSlip()
        self._dt = dt

    def predict(self, observation: Observation, biases: Array) -> Increment:
        forward, turn = biases.tolist()
        twist = np.array([forward, 0.0, turn])
        covariance = self._side_slip.covariance(turn, forward) + 1e-12 * np.eye(3)
        return Increment(exp(twist), covariance, exp_jacobian(twist)[:, [0, 2]])

    def learn(self, increment: Array | None) -> None:
        """The filter learns."""

    def tell(self, biases: Array, covariance: Array) -> dict[str, float]:
        return {"speed": float(biases[0]) / self._dt}
