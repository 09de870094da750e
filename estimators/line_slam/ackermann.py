"""The motion of a vehicle that steers: paper 2, eq. (5), in the frame of the pose before it."""

import numpy as np

from grouser.estimators.base import Observation
from grouser.estimators.line_slam.reported import reported
from grouser.estimators.visual.constant_errors import NO_ERRORS
from grouser.estimators.visual.prediction import Increment, MotionPredictor
from grouser.geometry import Array, wrap
from grouser.rig_motion import Steering


def reported_steering(observation: Observation) -> Array | None:
    """(2,) speed of the front wheel [m/s] and its angle [rad]; None where it reports NaN.

    Raises:
        ValueError: they are not two numbers, or infinite.
    """
    shape = "two numbers, speed [m/s] and angle [rad]"
    return reported(observation, "steering", shape=shape, n=2)


def steered(control: Array, wheelbase: float, dt: float) -> Array:
    """(3,) pose increment of the front axle's centre: eq. (5) from pose zero.

    Args:
        control: (2,) speed of the front wheel [m/s] and its angle [rad].
        wheelbase: m; dt: s.
    """
    speed, angle = control.tolist()
    way = dt * speed
    turn = way * np.sin(angle) / wheelbase
    return np.array([way * np.cos(angle), way * np.sin(angle), wrap(turn)])


def steered_jacobian(control: Array, wheelbase: float, dt: float) -> Array:
    """(3, 2) its derivative by speed and angle: eq. (7) corrected (SPEC 2.1), at heading zero."""
    speed, angle = control.tolist()
    c, s = np.cos(angle), np.sin(angle)
    return dt * np.array([[c, -speed * s], [s, speed * c], [s / wheelbase, speed * c / wheelbase]])


class AckermannPredictor(MotionPredictor):
    """The reported steering measures the increment, with the white noise that the rig tells."""

    measures = True
    errors = NO_ERRORS

    def __init__(self, steering: Steering, dt: float) -> None:
        """dt: s between two observations, for which the reported steering holds."""
        self._steering, self._dt = steering, dt
        self._last = np.zeros(2)

    def predict(self, observation: Observation, biases: Array) -> Increment:
        control = reported_steering(observation)
        if control is None:
            return self._increment(self._last, np.array([_UNKNOWN_SPEED, _UNKNOWN_ANGLE]), False)
        self._last = control
        sigmas = np.array([self._steering.sigma_speed, self._steering.sigma_angle])
        return self._increment(control, sigmas, True)

    def _increment(self, control: Array, sigmas: Array, measured: bool) -> Increment:
        J = steered_jacobian(control, self._steering.wheelbase, self._dt) * sigmas
        pose = steered(control, self._steering.wheelbase, self._dt)
        return Increment(pose, J @ J.T, np.zeros((3, 0)), measured)

    def learn(self, increment: Array | None) -> None:
        """What was reported last holds where nothing is."""

    def tell(self, biases: Array, covariance: Array) -> dict[str, float]:
        return {}


_UNKNOWN_SPEED, _UNKNOWN_ANGLE = 2.0, 0.3  # m/s, rad: one sigma where steering is not reported
