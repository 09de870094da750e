"""What a filter knows of tracks that turn about unknown centres: increments, and their errors.

Seven constant errors: how far the three centres of rotation (see `icr_motion`) lie from where they
are expected, which Martinez and Mandow (2005) calibrate, and Pentzer, Brennan and Reichard
("Model-based prediction of skid-steer robot kinematics using online estimation of track
instantaneous centers of rotation", J. Field Robotics 31, 2014) estimate online; and the scale
errors of the tracks and a slip across, which a straight drive tells apart from them; and how much
farther apart the centres are on the spot. Without that one a gyroscope's bias would have to explain
why a robot turns less there than the width that curves told: it then grew wrong with every turn on
the spot, and heading with it.
"""

from dataclasses import dataclass

import numpy as np

from grouser.checks import require_not_negative, require_positive
from grouser.estimators.base import Observation
from grouser.estimators.icr_motion import (
    exp_jacobian,
    icr_twist,
    icr_twist_jacobians,
    mirrored,
    mirrored_jacobian,
    on_the_spot,
    on_the_spot_slope,
)
from grouser.estimators.track_motion import GroundSlip, SideSlip, TrackNoise, reported_increments
from grouser.estimators.visual.constant_errors import ConstantErrors
from grouser.estimators.visual.prediction import Increment, MotionPredictor
from grouser.geometry import Array, exp
from grouser.kernels import kernel_using
from grouser.rig import TrackGeometry

_CENTRES, _SCALES, _SIDE, _SPOT = slice(0, 3), slice(3, 5), 5, 6
_OF_CENTRES = np.array([0, 1, 2, _SPOT])
_APART = np.array([0.5, -0.5, 0.0])
"""What a metre of width adds to each centre."""
_TOLD = ("icr_left", "icr_right", "icr_x", "effective_width")
_TOLD_SIGMAS = tuple(f"{name}_sigma" for name in _TOLD)


@dataclass(frozen=True, slots=True)
class IcrOptions:
    """How uncertain the centres are, and what else is uncertain about a track."""

    centre_sigma: float = 0.1
    """Of y_left and of y_right at the start, as a share of half the effective width."""
    ahead_sigma: float = 0.05
    """Of x at the start, m."""
    centre_walk: float = 1.5e-3
    """How far each centre wanders in one frame, m: ground and radius change."""
    scale_sigma: float = 0.01
    """Of a track's scale error; 0 gives the kinematics of the papers."""
    scale_walk: float = 1e-4
    """How far it wanders in one frame."""
    side_sigma: float = 0.02
    """Of the motion across, m per m along: on a slope the robot slides to one side."""
    side_walk: float = 5e-4
    """How far that wanders in one frame."""
    spot_sigma: float = 0.05
    """By how much farther the centres are apart on the spot than straight on, as a share of the
    effective width; 0 gives the kinematics of the papers."""
    spot_walk: float = 2e-4
    """How far that wanders in one frame, m."""
    track_noise: float = 0.015
    """White noise of a track's increment, as a share of it."""
    track_noise_floor: float = 2e-4
    """The same at rest, m."""
    transient_noise: float = 0.3
    """The same, as a share of the increment's change since the last one: the shear in the ground
    follows the tracks late."""
    turn_noise: float = 0.02
    """White noise of a turn, as a share of it: slip that comes and goes."""
    side_slip: float = 0.01
    """White sideways slip, m per m forward."""
    side_slip_turning: float = 0.005
    """The same, m per rad."""
    mirrored: bool = True
    """The centres are mirrored with the course, as `icr_motion.mirrored` says; without, they stay
    where they are in all curves, as in the papers."""

    def __post_init__(self) -> None:
        require_positive(self, "centre_sigma")
        require_not_negative(
            self,
            "ahead_sigma",
            "centre_walk",
            "scale_sigma",
            "scale_walk",
            "side_sigma",
            "side_walk",
            "spot_sigma",
            "spot_walk",
            "track_noise",
            "track_noise_floor",
            "transient_noise",
            "turn_noise",
            "side_slip",
            "side_slip_turning",
        )


class IcrPredictor(MotionPredictor):
    """Tracks measure the increment, about centres that the filter estimates."""

    measures = True

    def __init__(self, tracks: TrackGeometry, options: IcrOptions) -> None:
        half, far = tracks.effective_width / 2, options.centre_walk
        self._expected = np.array([half, -half, 0.0])
        centre, scale = options.centre_sigma * half, options.scale_sigma
        scale_walk = options.scale_walk if scale > 0 else 0.0
        side_walk = options.side_walk if options.side_sigma > 0 else 0.0
        spot = options.spot_sigma * tracks.effective_width
        spot_walk = options.spot_walk if spot > 0 else 0.0
        self.errors = ConstantErrors(
            (
                "left ICR [m]",
                "right ICR [m]",
                "x of the ICRs [m]",
                "left scale",
                "right scale",
                "side slip",
                "more width on the spot [m]",
            ),
            np.array([centre, centre, options.ahead_sigma, scale, scale, options.side_sigma, spot]),
            np.array([far, far, far, scale_walk, scale_walk, side_walk, spot_walk]),
        )
        self._options = options
        self._noise = TrackNoise(options.track_noise, options.track_noise_floor)
        side = SideSlip(options.side_slip, options.side_slip_turning)
        self._slip = GroundSlip(options.transient_noise, options.turn_noise, side)
        self._last = np.zeros(2)
        self._guess, self._silent = np.zeros(3), 0

    def predict(self, observation: Observation, biases: Array) -> Increment:
        measured = reported_increments(observation)
        if measured is None:
            return self._go_on(np.zeros((3, len(biases))))
        self._silent = 0
        du = measured * (1 + biases[_SCALES])
        of_left_curve, M = self._expected + biases[_CENTRES], self._course(du)
        spot = on_the_spot(du)
        centres = M @ of_left_curve + spot * biases[_SPOT] * _APART
        twist = icr_twist(du, centres)
        twist_by_du, twist_by_centres = icr_twist_jacobians(du, centres)
        if self._options.mirrored:
            twist_by_du = twist_by_du + twist_by_centres @ mirrored_jacobian(du, of_left_curve)
        by_width = twist_by_centres @ _APART
        twist_by_du = twist_by_du + np.outer(by_width, biases[_SPOT] * on_the_spot_slope(du))
        across = _across(biases[_SIDE])
        by_twist, straight = across @ exp_jacobian(twist), exp(twist)
        by_du = by_twist @ twist_by_du
        by_side = [-straight[1], straight[0], 0.0]
        by_spot = by_twist @ by_width * spot
        by_biases = np.column_stack(
            [by_twist @ twist_by_centres @ M, by_du * measured, by_side, by_spot]
        )
        of_tracks = by_du @ self._noise.covariance(du) @ by_du.T
        turn, change = float(twist[2]), measured - self._last
        slip = self._slip.covariance(turn, float(twist[0]), by_twist[:, 2], by_du, change)
        self._last, self._guess = measured.copy(), across @ straight
        return Increment(self._guess, of_tracks + slip, by_biases, of_tracks=of_tracks)

    def _go_on(self, by_biases: Array) -> Increment:
        """Silent tracks leave a guess, that the robot goes on as it went."""
        self._silent += 1
        way, turn = float(np.hypot(*self._guess[:2])), abs(float(self._guess[2]))
        sigma = np.array([way, way, turn]) + _CREEP
        # It may have stopped at once, or gone twice as fast: such errors add up, not their squares.
        spread = (2 * self._silent - 1) * np.diag(sigma**2)
        return Increment(self._guess, spread, by_biases, measured=False)

    def learn(self, increment: Array | None) -> None:
        """The tracks need to know no more than their last increment."""

    def tell(self, biases: Array, covariance: Array) -> dict[str, float]:
        """The centres of the present course and the effective width, each with its sigma, m."""
        as_course = self._options.mirrored
        told, sigmas = _of_course(self._last, as_course, self._expected, biases, covariance)
        return dict(zip(_TOLD + _TOLD_SIGMAS, (*told.tolist(), *sigmas.tolist()), strict=True))

    def _course(self, du: Array) -> Array:
        return mirrored(du) if self._options.mirrored else np.eye(3)


@kernel_using(mirrored, on_the_spot)
def _of_course(
    measured: Array, as_course: bool, expected: Array, biases: Array, covariance: Array
) -> tuple[Array, Array]:
    """(4,) the centres of the course that was measured (2,) and the width, and their sigmas, m."""
    du = measured * (1 + biases[3:5])
    by_errors = np.zeros((4, 4))
    by_errors[:3, :3] = mirrored(du) if as_course else np.eye(3)
    by_errors[:3, 3] = on_the_spot(du) * _APART
    by_errors[3] = by_errors[0] - by_errors[1]
    errors, P = np.append(expected, 0.0) + biases[_OF_CENTRES], covariance[_OF_CENTRES]
    P = np.ascontiguousarray(P[:, _OF_CENTRES])
    return by_errors @ errors, np.sqrt(np.diag(by_errors @ P @ by_errors.T))


_CREEP = np.array([0.01, 0.005, 0.02])  # m, m, rad a frame that a robot at rest may begin to move


def _across(slip: float) -> Array:
    """(3, 3) what adds a slip to the left of so much of the way, at right angles to the chord."""
    return np.array([[1.0, -slip, 0.0], [slip, 1.0, 0.0], [0.0, 0.0, 1.0]])
