"""Visual odometry in a Kalman filter: paper 1's Fig. 3, on keyframes (SPEC 1.5)."""

from dataclasses import replace
from functools import partial
from typing import Any, ClassVar, Literal

import numpy as np

from grouser.checks import require_at_least, require_positive_options
from grouser.estimators.base import Observation, PoseEstimate, PoseEstimator
from grouser.estimators.icr_predictor import IcrOptions, IcrPredictor
from grouser.estimators.slope import SlopeOptions, on_steep
from grouser.estimators.visual.base import Frontend
from grouser.estimators.visual.engine import (
    FilterFactory,
    KeyframeOdometry,
    OnSlope,
    as_on_level,
)
from grouser.estimators.visual.frontend import FEATURES, FrontendOptions
from grouser.estimators.visual.fusion import RelativeFilter
from grouser.estimators.visual.image_frontend import ImageFrontend
from grouser.estimators.visual.keyframes import KeyframeRule
from grouser.estimators.visual.late_images import LateImages
from grouser.estimators.visual.matching import MatchingOptions, PixelNoise
from grouser.estimators.visual.one_point import OnePointRansac
from grouser.estimators.visual.paper_form import MOST_POINTS, PaperForm, PaperOnePoint
from grouser.estimators.visual.prediction import (
    MotionPredictor,
    ScaleOptions,
    TrackPredictor,
    VelocityPredictor,
)
from grouser.estimators.visual.printed_filter import PrintedFilter
from grouser.estimators.visual.prior import REFINEMENTS, ChassisPrior
from grouser.estimators.visual.quality import QUALITIES
from grouser.estimators.visual.sight import FEWEST_MATCHES, KeyframeSight
from grouser.estimators.visual.solver import MotionSolver
from grouser.estimators.visual.solvers import make_solver
from grouser.estimators.visual.turn_errors import TURN_ERRORS
from grouser.kernels import announce
from grouser.rig import Rig, StereoCamera, TrackGeometry

SLIP = IcrOptions(side_walk=1e-4)
"""What is left to wander is lost to the heading; slip that the gate finds is learnt anew."""


class VisualOdometry(PoseEstimator):
    """Stereo visual odometry with a minimal solver by name, fused with the tracks where there are.

    Without tracks a constant velocity says where to search, and nothing is fused. A frame that
    vision fails on is bridged by prediction (COASTING); without tracks for a second, LOST.

    Images may come late, at a rate of their own, or one eye before the other: where an observation
    says so (`left_stamp` ...), the prediction leads from the last pair to now.
    """

    requires: ClassVar[frozenset[str]] = frozenset({"left", "right", "stamp"})
    optional: ClassVar[frozenset[str]] = frozenset({"tracks"})

    def __init__(
        self,
        rig: Rig,
        *,
        solver: str = "one-point",
        features: str = "fast",
        paper: bool | PaperForm = False,
        turn_error: Literal["sigmas", "sampson", "ratio"] = "sigmas",
        refinement: Literal["spatial", "planar", "arc"] = "spatial",
        frame_to_frame: bool = False,
        use_tracks: bool = True,
        frontend: Frontend[Any, Any] | None = None,
        quality: str = "standard",
        max_points: int | None = None,
        corners: int | None = None,
        place_noise_px: float = 0.08,
        disparity_noise_px: float = 0.1,
        roll_pitch_prior: float = 0.003,
        side_slip_prior: float = 0.02,
        keyframe_distance: float = 0.25,
        keyframe_turn: float = 0.2,
        lost_after: float = 1.0,
        slip_states: IcrOptions | ScaleOptions | None = None,
    ) -> None:
        """
        Args:
            rig: the calibration; `stereo` is needed, `tracks` used where there are any.
            solver: the minimal solver by name, one of `visual.solvers.SOLVERS`.
            features: "fast" (corners with binary descriptors) or "sift", which takes many times as
                long.
            paper: the paper as printed where it can be computed (see `visual.paper_form`): planar,
                non-holonomic motion as a law, from frame to frame, and the printed filter where the
                rig has tracks. A `PaperForm` chooses among what is printed and what is left open.
                It sets refinement and frame_to_frame, and no more than 64 points are used.
            turn_error: what one-point's matches must keep for a turn: their own sigmas, the Sampson
                error, or the paper's eq. (20) (see `visual.turn_errors`).
            refinement: "spatial", in six degrees of freedom with priors of a chassis; "planar",
                turn, chord and side, for a robot that neither climbs nor tilts; or "arc", turn and
                chord, for one that never slips sideways either.
            frame_to_frame: compare each frame with the one before it, as the paper does, instead of
                with a keyframe; the errors of frames add up faster.
            use_tracks: fuse the tracks where there are any; otherwise they are not even read.
            frontend: another source of features than the images.
            quality: how much of the images is looked at, one of `visual.quality.QUALITIES`; "fast",
                "standard" and "high" take 7, 8 and 16 ms for a pair of 1226 x 370 px.
            max_points: matched points that the estimation uses; left out, as `quality` has it.
            corners: corners sought in each image; left out, as `quality` has it.
            place_noise_px: sigma of an aligned point, px.
            disparity_noise_px: sigma of a disparity, px.
            roll_pitch_prior: sigma of roll and of pitch between two frames, rad.
            side_slip_prior: sigma of the motion across, m per m along, where there are no tracks.
            keyframe_distance: m after which the reference frame is replaced.
            keyframe_turn: rad after which it is.
            lost_after: s of prediction without tracks until the pose is LOST.
            slip_states: what the filter estimates of the tracks' slip, and how uncertain it is: the
                instantaneous centres of rotation beside both tracks' scales (`IcrOptions`), or
                scales alone, of both tracks, the turn and the motion across (`ScaleOptions`, as in
                SPEC 1.5), which lead less well in the dark. Left out, `IcrOptions` with a
                `side_walk` of 1e-4; the paper's form has scales.

        Raises:
            ValueError: an unknown solver, an option out of range, or a rig without a stereo camera.
        """
        _require_one_of(tuple(QUALITIES), quality=quality)
        preset = QUALITIES[quality]
        max_points = preset.max_points if max_points is None else max_points
        corners = preset.corners if corners is None else corners
        require_at_least(FEWEST_MATCHES, max_points=max_points, corners=corners)
        require_positive_options(
            place_noise_px=place_noise_px,
            disparity_noise_px=disparity_noise_px,
            roll_pitch_prior=roll_pitch_prior,
            side_slip_prior=side_slip_prior,
            keyframe_distance=keyframe_distance,
            keyframe_turn=keyframe_turn,
            lost_after=lost_after,
        )
        if rig.stereo is None:
            raise ValueError("visual odometry needs rig.stereo, and this rig has None")
        camera = rig.stereo
        slip_states = _known_states(slip_states, ScaleOptions() if paper else SLIP)
        _require_one_of(tuple(REFINEMENTS), refinement=refinement)
        _require_one_of(("sigmas", *TURN_ERRORS), turn_error=turn_error)
        minimal_solver = _make_solver(solver, camera, turn_error)
        make_filter: FilterFactory = partial(
            RelativeFilter,
            disparity_sigma=float(np.hypot(camera.disparity_sigma, _ALIGNMENT_BIAS)),
        )
        if paper:
            form = PaperForm() if paper is True else paper
            _require_one_of(("one-point",), solver=solver)
            camera = form.camera(camera)
            minimal_solver = PaperOnePoint(camera, form)
            if rig.tracks is not None and use_tracks:
                make_filter = PrintedFilter
            if not isinstance(slip_states, ScaleOptions):
                raise ValueError(f"paper=... has ScaleOptions as slip_states, not {slip_states!r}")
            refinement, frame_to_frame, max_points = "arc", True, min(max_points, MOST_POINTS)
        _require_one_of(tuple(FEATURES), features=features)
        announce()
        frontend = frontend or ImageFrontend(
            camera,
            options=FrontendOptions(corners=corners, features=features),
            matching=MatchingOptions(max_points=max_points),
            noise=PixelNoise(place=place_noise_px, disparity=disparity_noise_px),
        )
        rule = KeyframeRule(distance=keyframe_distance, turn=keyframe_turn, points=max_points)
        make_predictor = partial(
            _make_predictor,
            tracks=rig.tracks if use_tracks else None,
            dt=rig.dt,
            slip_states=slip_states,
        )
        odometry = KeyframeOdometry(
            frontend,
            KeyframeSight(camera, frontend, minimal_solver, constraint=REFINEMENTS[refinement]),
            make_predictor=make_predictor,
            make_filter=make_filter,
            prior=ChassisPrior(tilt_floor=roll_pitch_prior, side_per_chord=side_slip_prior),
            mount_sigma=camera.mount_sigma,
            rule=replace(rule, frames=1) if frame_to_frame else rule,
            lost_after=lost_after,
            on_slope=_on_slope(rig.tracks),
        )
        self._engine = LateImages(odometry, make_predictor, dt=rig.dt, lost_after=lost_after)

    def reset(self, observation: Observation, *, rng: np.random.Generator) -> PoseEstimate:
        """Start at pose zero, known exactly, with the first frame as keyframe."""
        return self._engine.reset(observation, rng=rng)

    def update(self, observation: Observation) -> PoseEstimate:
        """One frame of Fig. 3.

        Raises:
            RuntimeError: `reset` was not called yet.
            ValueError: images that are not the rig's, or tracks that are not finite.
        """
        return self._engine.update(observation)


def _make_solver(name: str, camera: StereoCamera, turn_error: str) -> MotionSolver:
    if turn_error == "sigmas":
        return make_solver(name, camera)
    if name != "one-point":
        raise ValueError(f"turn_error={turn_error!r} is for solver 'one-point', not for {name!r}")
    return OnePointRansac(camera, turn_error=turn_error)


def _known_states(
    chosen: IcrOptions | ScaleOptions | None, otherwise: IcrOptions | ScaleOptions
) -> IcrOptions | ScaleOptions:
    chosen = otherwise if chosen is None else chosen
    if not isinstance(chosen, IcrOptions | ScaleOptions):
        raise ValueError(f"slip_states must be an IcrOptions or a ScaleOptions, got {chosen!r}")
    return chosen


def _on_slope(tracks: TrackGeometry | None) -> OnSlope:
    """Tracks slip there, and creep; what no track measured is uncertain enough."""
    if tracks is None:
        return as_on_level
    return partial(on_steep, width=tracks.effective_width, options=SlopeOptions())


def _make_predictor(
    observation: Observation,
    *,
    tracks: TrackGeometry | None,
    dt: float,
    slip_states: IcrOptions | ScaleOptions,
) -> MotionPredictor:
    """By the tracks, where there are any."""
    if tracks is not None and "tracks" in observation:
        if isinstance(slip_states, IcrOptions):
            return IcrPredictor(tracks, slip_states)
        return TrackPredictor(tracks, slip_states)
    return VelocityPredictor(_FASTEST * dt)


_FASTEST = np.array([15.0, 1.0, 1.0])  # m/s, m/s, rad/s: one sigma of an unknown velocity
# px of disparity that interpolation shifts all points by, one sigma; a test measures it.
_ALIGNMENT_BIAS = 0.02


def _require_one_of(known: tuple[str, ...], **options: str) -> None:
    for name, value in options.items():
        if value not in known:
            raise ValueError(f"{name} must be one of {', '.join(map(repr, known))}, got {value!r}")
