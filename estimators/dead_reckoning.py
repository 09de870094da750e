"""Dead reckoning: increments of the motion added up, with the errors that add up along."""

import math
from typing import ClassVar

import numpy as np

from grouser.estimators.base import Observation, PoseEstimate, PoseEstimator, Status
from grouser.estimators.line_slam.odometry_predictor import OdometryPredictor
from grouser.estimators.slope import SlopeOptions, unknown_covariance
from grouser.estimators.track_motion import (
    SideSlip,
    TrackNoise,
    arc_jacobian,
    arc_pose,
    chord,
    observed_increments,
    track_increment,
    track_increment_jacobian,
)
from grouser.estimators.visual.prediction import Increment
from grouser.geometry import Array, compose, compose_jacobians
from grouser.rig import Rig, TrackGeometry


class DeadReckoning(PoseEstimator):
    """Eqs. (2) to (5) of the first paper with the exact arc and true Jacobians (SPEC 1.1).

    The covariance belongs to seven states: the pose; the scale errors of the left and the right
    track and of the turn; and the outward slip in turns. Nothing observes the last four; they
    correlate the errors of all increments.

    A robot without tracks that reports `odometry` is followed by that; its two constant errors are
    the scale and a turn per metre, as large as `rig.odometry` says.

    Its status is always COASTING: it never looks at the outside world, so its covariance can only
    grow.
    """

    requires: ClassVar[frozenset[str]] = frozenset({"stamp"})
    optional: ClassVar[frozenset[str]] = frozenset({"tracks", "odometry"})
    requires_one_of: ClassVar[tuple[frozenset[str], ...]] = (frozenset({"tracks", "odometry"}),)

    def __init__(
        self,
        rig: Rig,
        *,
        track_noise: float = 0.03,
        track_noise_floor: float = 0.0002,
        side_slip: float = 0.02,
        side_slip_turning: float = 0.005,
        track_scale_sigma: float = 0.01,
        turn_scale_sigma: float = 0.05,
        outward_slip_sigma: float = 0.03,
        turn_drag_sigma: float = 0.03,
        slope: float = SlopeOptions().unknown,
    ) -> None:
        """
        Args:
            rig: the calibration; its `tracks` are used, or `odometry` where it has no tracks. All
                that follows is of tracks.
            track_noise: white noise of a track's increment, as a share of the increment.
            track_noise_floor: the same at rest, m.
            side_slip: white sideways slip, m per m forward.
            side_slip_turning: the same, m per rad.
            track_scale_sigma: share of a track's increment that slips or is miscalibrated all the
                time. Constant errors never average out; they are why dead reckoning drifts.
            turn_scale_sigma: share of a turn beside what the tracks' scales explain: the effective
                width depends on the ground and on the radius.
            outward_slip_sigma: m per rad that the robot slides sideways in every turn as it drives
                along, and not where it turns on the spot: the shear under a track builds up
                towards its rear, which shifts the centre of rotation.
            turn_drag_sigma: m per rad that it falls short of its way in every turn that it drives
                along: tracks that slide sideways have less grip left against the motion
                resistance. On grass it is 0.07 in our simulation, on cement 0.02.
            slope: root mean square of the sine of slopes on the way, where the robot creeps and
                slips. On hills and rubble tell it, say 0.1: tracks alone do not.

        Raises:
            ValueError: the rig has neither tracks nor odometry, or a sigma or the slope is
                negative.
        """
        if rig.tracks is None and rig.odometry is None:
            raise ValueError(
                "dead reckoning needs rig.tracks or rig.odometry, and this rig has neither; pass "
                "an override such as "
                "rig={'tracks': TrackGeometry(gauge=..., width=..., effective_width=...)}"
            )
        self._rig = rig
        self._track_noise = TrackNoise(scale=track_noise, floor=track_noise_floor)
        self._side_slip = SideSlip(forward=side_slip, turning=side_slip_turning)
        self._slope = SlopeOptions(unknown=slope)
        self._constant_sigmas = np.array(
            [
                track_scale_sigma,
                track_scale_sigma,
                turn_scale_sigma,
                outward_slip_sigma,
                turn_drag_sigma,
            ]
        )
        if not (np.isfinite(self._constant_sigmas) & (self._constant_sigmas >= 0)).all():
            raise ValueError(
                f"every sigma must be finite and zero or more, got {self._constant_sigmas}"
            )
        self._pose = np.zeros(3)
        self._covariance = np.zeros((3, 3))
        self._walks = np.zeros(0)
        self._started = False

    def reset(self, observation: Observation, *, rng: np.random.Generator) -> PoseEstimate:
        """Start at pose zero, known exactly, the constant errors as their sigmas say."""
        self._pose = np.zeros(3)
        sigmas, self._walks = self._constant_sigmas, np.zeros(5)
        if self._rig.tracks is None:
            assert self._rig.odometry is not None
            self._predictor = OdometryPredictor(self._rig.odometry)
            sigmas, self._walks = self._predictor.errors.sigmas, self._predictor.errors.walks
        self._covariance = np.diag([0.0, 0.0, 0.0, *sigmas**2])
        self._started = True
        return self._estimate(observation)

    def update(self, observation: Observation) -> PoseEstimate:
        """Add one increment.

        Raises:
            RuntimeError: `reset` was not called yet.
            ValueError: the increments are not finite numbers, two of tracks, three of odometry.
        """
        if not self._started:
            raise RuntimeError("call reset() with the first observation before update()")
        if self._rig.tracks is None:
            self._add(self._predictor.predict(observation, np.zeros(len(self._walks))))
        else:
            self._add(self._of_tracks(self._rig.tracks, observed_increments(observation)))
        return self._estimate(observation)

    def _of_tracks(self, tracks: TrackGeometry, du: Array) -> Increment:
        width = tracks.effective_width
        turn, arc_length = track_increment(du, width)
        by_arc = arc_jacobian(turn, arc_length)
        by_du = by_arc @ track_increment_jacobian(width)
        slip = outward_slip(turn, arc_length, width)
        drag = by_arc[:, 1] * -turn_drag(turn, arc_length, width)
        by_constants = np.column_stack([by_du * du, by_arc[:, 0] * turn, slip, drag])
        noise = by_du @ self._track_noise.covariance(du) @ by_du.T
        noise += self._side_slip.covariance(turn, chord(turn, arc_length))
        noise += unknown_covariance(turn, width, self._slope)
        return Increment(arc_pose(turn, arc_length), noise, by_constants)

    def _add(self, increment: Increment) -> None:
        by_pose, by_increment = compose_jacobians(self._pose, increment.pose)
        F = np.eye(len(self._covariance))
        F[:3, :3], F[:3, 3:] = by_pose, by_increment @ increment.by_biases
        P = F @ self._covariance @ F.T
        P[:3, :3] += by_increment @ increment.covariance @ by_increment.T
        P[3:, 3:] += np.diag(self._walks**2)
        self._pose = compose(self._pose, increment.pose)
        self._covariance = (P + P.T) / 2

    def _estimate(self, observation: Observation) -> PoseEstimate:
        return PoseEstimate(
            pose=self._pose.copy(),
            covariance=self._covariance[:3, :3].copy(),
            status=Status.COASTING,
            stamp=float(observation["stamp"][0]),
        )


def outward_slip(turn: float, arc_length: float, width: float) -> Array:
    """(3,) pose increment of an outward slip of 1 m per rad, in a turn of `turn` [rad].

    It fades where the radius falls below the width: on the spot no side is outward.
    """
    reach = math.hypot(arc_length, width * turn)
    sideways = -turn * arc_length / reach if reach > 0 else 0.0
    return sideways * np.array([-math.sin(turn / 2), math.cos(turn / 2), 0.0])


def turn_drag(turn: float, arc_length: float, width: float) -> float:
    """How much shorter an arc is by a drag of 1 m per rad, m.

    It fades where the centre of the turn comes between the tracks: the inner one then runs
    backwards, and what resists one helps the other.
    """
    between_tracks = abs(turn) * width / 2
    return abs(turn) * float(np.clip(arc_length / between_tracks, -1, 1)) if turn else 0.0
