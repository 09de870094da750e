"""Pose increments that a robot worked out for itself, as a prediction that may be far off."""

import numpy as np

from grouser.estimators.base import Observation
from grouser.estimators.line_slam.reported import reported
from grouser.estimators.visual.constant_errors import ConstantErrors
from grouser.estimators.visual.prediction import Increment, MotionPredictor
from grouser.geometry import Array
from grouser.rig_motion import Odometry


def reported_odometry(observation: Observation) -> Array | None:
    """(3,) x, y [m], heading [rad] since the last observation; None where it reports NaN.

    Raises:
        ValueError: they are not three numbers, or infinite.
    """
    shape = "three numbers, x, y [m] and heading [rad]"
    return reported(observation, "odometry", shape=shape, n=3)


class OdometryPredictor(MotionPredictor):
    """The robot's own increments, with two constant errors: its scale, and a turn per metre.

    Of what `Odometry` says of heading per metre and position per metre, most is the same for long
    (SPEC 2.6); what the constant errors do not explain stays as white noise.
    """

    measures = True

    def __init__(self, odometry: Odometry) -> None:
        self._odometry = odometry
        self.errors = ConstantErrors(
            ("odometry's scale", "odometry's turn per metre [rad/m]"),
            np.array([odometry.position_per_metre, odometry.heading_per_metre]),
            _WALK * np.array([odometry.position_per_metre, odometry.heading_per_metre]),
        )
        self._last = np.zeros(3)

    def predict(self, observation: Observation, biases: Array) -> Increment:
        told = reported_odometry(observation)
        measured = told is not None
        if told is None:
            told = self._last
        self._last = told
        scale, turn = biases.tolist()
        way = float(np.hypot(told[0], told[1]))
        pose = np.append((1 + scale) * told[:2], told[2] + turn * way)
        by_biases = np.zeros((3, 2))
        by_biases[:2, 0], by_biases[2, 1] = told[:2], way
        o = self._odometry
        position = o.position + o.position_per_metre * way
        # The errors of different causes need not hide each other: their sigmas add up (SPEC 2.6).
        heading = o.heading + o.heading_per_metre * way
        heading += o.heading_per_radian * abs(float(told[2]))
        sigmas = np.array([position, position, heading])
        if not measured:
            sigmas = sigmas + _UNKNOWN
        return Increment(pose, np.diag(sigmas**2), by_biases, measured)

    def learn(self, increment: Array | None) -> None:
        """What was reported last is expected again where nothing is."""

    def tell(self, biases: Array, covariance: Array) -> dict[str, float]:
        return {"odometry_scale": float(biases[0]), "odometry_turn_per_metre": float(biases[1])}


_WALK = 0.03  # of a constant error's sigma, a frame: carpets end, loads shift
_UNKNOWN = np.array([0.5, 0.2, 0.3])  # m, m, rad: one sigma more where nothing was reported
