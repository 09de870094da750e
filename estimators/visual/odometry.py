"""Visual odometry in a Kalman filter: paper 1's Fig. 3, on keyframes (SPEC 1.5)."""

import time
from numbers import Integral
from typing import ClassVar

import numpy as np

from grouser.estimators.base import Observation, PoseEstimate, PoseEstimator, Status
from grouser.estimators.track_motion import SideSlip, TrackNoise
from grouser.estimators.visual.descriptor import Image
from grouser.estimators.visual.five_point import FivePointRansac
from grouser.estimators.visual.frontend import FrontendOptions, StereoFrame, StereoFrontend, grey
from grouser.estimators.visual.fusion import NOTHING_YET, Fused, RelativeFilter, RelativePose
from grouser.estimators.visual.keyframes import KeyframeRule
from grouser.estimators.visual.matching import MatchingOptions, PixelNoise
from grouser.estimators.visual.motion import chassis_pose
from grouser.estimators.visual.one_point import OnePointRansac
from grouser.estimators.visual.prediction import (
    MotionPredictor,
    TrackPredictor,
    VelocityPredictor,
)
from grouser.estimators.visual.prior import ChassisPrior, MotionPrior
from grouser.estimators.visual.sight import (
    FEWEST_MATCHES,
    Expectation,
    KeyframeSight,
    Sight,
    pose_motion,
    pose_to_motion,
)
from grouser.geometry import Array, between, compose, compose_jacobians
from grouser.kernels import announce
from grouser.rig import Rig, StereoCamera

SOLVERS = {"one-point": OnePointRansac, "five-point": FivePointRansac}


class VisualOdometry(PoseEstimator):
    """Stereo visual odometry with a minimal solver by name, fused with the tracks where there are.

    Without tracks a constant velocity says where to search, and nothing is fused. A frame that
    vision fails on is bridged by prediction (COASTING); without tracks for a second, LOST.
    """

    requires: ClassVar[frozenset[str]] = frozenset({"left", "right", "stamp"})
    optional: ClassVar[frozenset[str]] = frozenset({"tracks"})

    def __init__(
        self,
        rig: Rig,
        *,
        solver: str = "one-point",
        max_points: int = 64,
        corners: int = 900,
        place_noise_px: float = 0.08,
        disparity_noise_px: float = 0.1,
        roll_pitch_prior: float = 0.003,
        side_slip_prior: float = 0.02,
        track_noise: float = 0.03,
        track_scale_sigma: float = 0.05,
        turn_scale_sigma: float = 0.10,
        turn_noise: float = 0.05,
        keyframe_distance: float = 0.25,
        keyframe_turn: float = 0.2,
        lost_after: float = 1.0,
    ) -> None:
        """
        Args:
            rig: the calibration; `stereo` is needed, `tracks` used where there are any.
            solver: the minimal solver: "one-point" or "five-point".
            max_points: matched points that the estimation uses.
            corners: corners sought in each image.
            place_noise_px: sigma of an aligned point, px.
            disparity_noise_px: sigma of a disparity, px.
            roll_pitch_prior: sigma of roll and of pitch between two frames, rad.
            side_slip_prior: sigma of the motion across, m per m along.
            track_noise: white noise of a track's increment, as a share of it.
            track_scale_sigma: sigma of a track's unknown scale error.
            turn_scale_sigma: sigma of the effective width's unknown scale error.
            turn_noise: white slip of a turn, as a share of it.
            keyframe_distance: m after which the reference frame is replaced.
            keyframe_turn: rad after which it is.
            lost_after: s of prediction without tracks until the pose is LOST.

        Raises:
            ValueError: an unknown solver, an option out of range, or a rig without a stereo camera.
        """
        _require_at_least(FEWEST_MATCHES, max_points=max_points, corners=corners)
        _require_positive(
            place_noise_px=place_noise_px,
            disparity_noise_px=disparity_noise_px,
            roll_pitch_prior=roll_pitch_prior,
            side_slip_prior=side_slip_prior,
            track_noise=track_noise,
            track_scale_sigma=track_scale_sigma,
            turn_scale_sigma=turn_scale_sigma,
            turn_noise=turn_noise,
            keyframe_distance=keyframe_distance,
            keyframe_turn=keyframe_turn,
            lost_after=lost_after,
        )
        if solver not in SOLVERS:
            raise ValueError(f"no solver is named {solver!r}; known: {', '.join(sorted(SOLVERS))}")
        if rig.stereo is None:
            raise ValueError("visual odometry needs rig.stereo, and this rig has None")
        announce()
        self._rig = rig
        self._camera: StereoCamera = rig.stereo
        self._frontend = StereoFrontend(
            FrontendOptions(corners=corners), disparity_offset=rig.stereo.disparity_offset
        )
        self._sight = KeyframeSight(
            rig.stereo,
            SOLVERS[solver](rig.stereo),
            matching=MatchingOptions(max_points=max_points),
            noise=PixelNoise(place=place_noise_px, disparity=disparity_noise_px),
        )
        self._prior = ChassisPrior(tilt_floor=roll_pitch_prior, side_per_chord=side_slip_prior)
        self._track_noise = TrackNoise(scale=track_noise)
        self._turn_noise = turn_noise
        offset = np.hypot(rig.stereo.disparity_sigma, _ALIGNMENT_BIAS)
        self._bias_sigmas = np.array(
            [track_scale_sigma, track_scale_sigma, turn_scale_sigma, offset]
        )
        self._rule = KeyframeRule(distance=keyframe_distance, turn=keyframe_turn, points=max_points)
        self._lost_after = lost_after
        self._rng: np.random.Generator | None = None

    def reset(self, observation: Observation, *, rng: np.random.Generator) -> PoseEstimate:
        """Start at pose zero, known exactly, with the first frame as keyframe."""
        self._rng = rng
        self._predictor = self._make_predictor(observation)
        self._filter = RelativeFilter(bias_sigmas=self._bias_sigmas, scale_walk=_SCALE_WALK)
        self._frontend.reset()
        self._keyframe = self._frontend.make_keyframe(self._extract(observation))
        self._keyframe_pose_3d = np.eye(4)
        self._predicted = NOTHING_YET
        self._believed = Expectation(np.zeros(3), np.zeros((3, 3)))
        self._failures = 0
        self._last_seen = float(observation["stamp"][0])
        return PoseEstimate(
            pose=np.zeros(3),
            covariance=np.zeros((3, 3)),
            status=Status.TRACKING,
            stamp=self._last_seen,
            pose_3d=np.eye(4),
        )

    def update(self, observation: Observation) -> PoseEstimate:
        """Stereo, prediction, sight, filter, keyframe: one frame of Fig. 3.

        Raises:
            RuntimeError: `reset` was not called yet.
            ValueError: images that are not the rig's, or tracks that are not finite.
        """
        if self._rng is None:
            raise RuntimeError("call reset() with the first observation before update()")
        started = time.perf_counter()
        frame = self._extract(observation)
        extracted = time.perf_counter()
        expected = self._predict(observation)
        sight = self._sight.look(self._keyframe, frame, expected, self._believe(), self._rng)
        looked = time.perf_counter()
        seen = None if sight.motion is None else sight.planar()
        fused = self._fuse(seen)
        relative = self._filter.relative(fused)
        pose_3d = self._keyframe_pose_3d @ chassis_pose(relative, *sight.out_of_plane())
        self._learn(relative, seen, expected)
        status = self._status(sight, float(observation["stamp"][0]))
        diagnostics = sight.diagnostics | {
            "features": float(len(frame.points)),
            "nis": fused.nis,
            "slipped": float(fused.slipped),
            "keyframe_age": float(self._predicted.frames),
            "ms_stereo": 1e3 * (extracted - started),
            "ms_filter": 1e3 * (time.perf_counter() - looked),
        }
        age = self._predicted.frames
        if self._rule.replaces(relative, sight, frames=age, failures=self._failures):
            self._commit(fused, frame, pose_3d)
        return PoseEstimate(
            pose=fused.state.pose.copy(),
            covariance=fused.state.covariance[:3, :3].copy(),
            status=status,
            stamp=float(observation["stamp"][0]),
            pose_3d=pose_3d,
            diagnostics=diagnostics,
        )

    def _extract(self, observation: Observation) -> StereoFrame:
        left, right = (self._image(observation, eye) for eye in ("left", "right"))
        return self._frontend.extract(left, right)

    def _image(self, observation: Observation, eye: str) -> Image:
        image = grey(observation[eye], eye)
        # Of another size, calibration and pixels disagree, and kernels would leave the image.
        expected = (self._camera.height, self._camera.width)
        if image.shape != expected:
            raise ValueError(
                f"observation {eye!r} is {image.shape[1]} x {image.shape[0]} px, but rig.stereo is "
                f"calibrated for {expected[1]} x {expected[0]}: make the environment with images "
                "of that size, and estimate before whatever resizes them"
            )
        return image

    def _make_predictor(self, observation: Observation) -> MotionPredictor:
        if self._rig.tracks is not None and "tracks" in observation:
            return TrackPredictor(self._rig.tracks, self._track_noise, SideSlip(), self._turn_noise)
        return VelocityPredictor(_FASTEST * self._rig.dt)

    def _predict(self, observation: Observation) -> Expectation:
        """Takes the increment into the filter's prediction, and says where to search."""
        increment = self._predictor.predict(observation, self._filter.keyframe.biases)
        self._predicted = self._predicted.then(increment)
        F, V = compose_jacobians(self._believed.pose, increment.pose)
        biases = self._filter.keyframe.covariance[3:, 3:]
        noise = increment.covariance + increment.by_biases @ biases @ increment.by_biases.T
        covariance = F @ self._believed.covariance @ F.T + V @ noise @ V.T
        return Expectation(compose(self._believed.pose, increment.pose), covariance)

    def _believe(self) -> MotionPrior:
        """The prior of the motion since the keyframe, from the prediction alone."""
        predicted = self._predicted
        by_pose = pose_to_motion(predicted.pose)[2]
        side_sigma = float(np.sqrt(by_pose @ predicted.covariance @ by_pose))
        return self._prior.about(pose_motion(predicted.pose), side_sigma, self._camera.mount_sigma)

    def _fuse(self, seen: RelativePose | None) -> Fused:
        if seen is None:
            return self._filter.coast(self._predicted)
        if self._predictor.measures:
            return self._filter.fuse(self._predicted, seen)
        return self._filter.follow(seen, self._predicted.frames)

    def _learn(self, relative: Array, seen: RelativePose | None, expected: Expectation) -> None:
        """What the next prediction starts from."""
        if seen is None:
            self._failures += 1
            self._believed = Expectation(relative, expected.covariance)
        else:
            self._failures = 0
            self._predictor.learn(between(self._believed.pose, relative))
            self._believed = Expectation(relative, seen.covariance)

    def _status(self, sight: Sight, stamp: float) -> Status:
        if sight.motion is not None:
            self._last_seen = stamp
            return Status.TRACKING
        if not self._predictor.measures and stamp - self._last_seen > self._lost_after:
            self._predictor.learn(None)
            return Status.LOST
        return Status.COASTING

    def _commit(self, fused: Fused, frame: StereoFrame, pose_3d: Array) -> None:
        self._filter.commit(fused)
        self._keyframe = self._frontend.make_keyframe(frame)
        self._keyframe_pose_3d = pose_3d.copy()
        self._predicted = NOTHING_YET
        self._believed = Expectation(np.zeros(3), np.zeros((3, 3)))


_FASTEST = np.array([15.0, 1.0, 1.0])  # m/s, m/s, rad/s: one sigma of an unknown velocity
_SCALE_WALK = 5e-4  # how far a track's scale error wanders a frame, one sigma (SPEC 1.5)
# px of disparity that interpolation shifts all points by, one sigma; a test measures it.
_ALIGNMENT_BIAS = 0.02


def _require_at_least(least: int, **counts: int) -> None:
    for name, value in counts.items():
        if not isinstance(value, Integral) or value < least:
            raise ValueError(f"{name} must be a whole number of at least {least}, got {value!r}")


def _require_positive(**values: float) -> None:
    for name, value in values.items():
        if not (np.isfinite(value) and value > 0):
            raise ValueError(f"{name} must be positive and finite, got {value!r}")
