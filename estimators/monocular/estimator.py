"""`one-point-ekf` and `two-point-ekf`: monocular SLAM as a pose estimator, with its options."""

from functools import partial
from typing import ClassVar

import numpy as np

from grouser.checks import require_at_least, require_positive_options
from grouser.estimators.base import Observation, PoseEstimate, PoseEstimator
from grouser.estimators.monocular.landmarks import LandmarkMap
from grouser.estimators.monocular.look import FEWEST
from grouser.estimators.monocular.management import MapOptions
from grouser.estimators.monocular.motion_model import CONSTANT_NAMES, TrackModel
from grouser.estimators.monocular.odometry import MonocularOdometry
from grouser.estimators.monocular.picture import PictureTaker
from grouser.estimators.monocular.prediction import TrackModelPredictor
from grouser.estimators.monocular.search import SearchOptions
from grouser.estimators.monocular.slam import InverseDepthSlam, PatchNoise
from grouser.estimators.track_motion import TrackNoise
from grouser.estimators.visual.constant_errors import ConstantErrors
from grouser.estimators.visual.late_images import LateImages
from grouser.estimators.visual.prior import ChassisPrior
from grouser.kernels import announce
from grouser.rig import Rig


class MonocularEkf(PoseEstimator):
    """EKF SLAM with the left camera alone, its scale from the tracks (see this folder).

    An image that shows too little, or of the map too little where it should be, is bridged by the
    tracks (COASTING). So is one that stands while the tracks drive: where the robot is then lies
    between where it was and where the tracks say, until a later image tells (`stands_still` in the
    diagnostics). Increments that are not finite are no word from the tracks: the motion is then
    expected to go on as it was, and the map keeps the scale while it lasts.

    Images may come late or seldom: where an observation says so (`left_stamp`), the tracks lead
    from the last one to now.
    """

    requires: ClassVar[frozenset[str]] = frozenset({"left", "tracks", "stamp"})

    def __init__(
        self,
        rig: Rig,
        *,
        sample: int = 1,
        points: int = 60,
        corners: int = 500,
        inverse_depth_sigma: float = 6.0,
        threshold_px: float = 1.0,
        place_noise_px: float = 0.5,
        roll_pitch_prior: float = 0.003,
        side_slip_prior: float = 0.02,
        track_noise: float = 0.03,
        track_noise_floor: float = 0.0002,
        track_scale_sigma: float = 0.01,
        turn_scale_sigma: float = 0.05,
        turn_noise: float = 0.05,
        outward_slip_sigma: float = 0.03,
        turn_drag_sigma: float = 0.012,
    ) -> None:
        """
        Args:
            rig: the calibration; `stereo`, of which the left camera is used, and `tracks`.
            sample: matches that a hypothesis takes: 1 (Civera et al.) or 2 (Xu, Li and Han).
            points: most points that the filter holds.
            corners: corners sought in each image.
            inverse_depth_sigma: of a new point, 1/m. So wide that it says nothing of the scale.
            threshold_px: how far a low-innovation inlier may be from where a hypothesis expects
                it, px in an image 320 px wide.
            place_noise_px: sigma of an aligned point, px. A patch errs by 0.03 px from one image
                to the next and by 0.1 px after ten, but by much the same in each: so long as the
                filter takes errors for white, they count for more.
            roll_pitch_prior: sigma of roll and of pitch between two frames, rad.
            side_slip_prior: sigma of the motion across, m per m along.
            track_noise: white noise of a track's increment, as a share of it.
            track_noise_floor: the same at rest, m.
            track_scale_sigma: share of a track's increment that slips or is miscalibrated all the
                time. What both tracks have in common of it no single camera can see.
            turn_scale_sigma: sigma of the effective width's unknown scale error.
            turn_noise: white slip of a turn, as a share of it.
            outward_slip_sigma: m per rad that the robot slides outward in turns, all the time.
            turn_drag_sigma: m per rad that it falls short of its way in turns.

        Raises:
            ValueError: an option out of range, or a rig without a camera or without tracks.
        """
        if sample not in (1, 2):
            raise ValueError(f"sample must be 1 or 2 matches a hypothesis, got {sample!r}")
        require_at_least(FEWEST, points=points, corners=corners)
        require_positive_options(
            inverse_depth_sigma=inverse_depth_sigma,
            threshold_px=threshold_px,
            place_noise_px=place_noise_px,
            roll_pitch_prior=roll_pitch_prior,
            side_slip_prior=side_slip_prior,
            track_noise=track_noise,
            track_noise_floor=track_noise_floor,
            track_scale_sigma=track_scale_sigma,
            turn_scale_sigma=turn_scale_sigma,
            turn_noise=turn_noise,
            outward_slip_sigma=outward_slip_sigma,
            turn_drag_sigma=turn_drag_sigma,
        )
        if rig.stereo is None:
            raise ValueError("monocular SLAM needs rig.stereo for its camera; this rig has None")
        if rig.tracks is None:
            raise ValueError(
                "monocular SLAM needs rig.tracks, because one camera alone cannot tell how far it "
                "went, and this rig has None; give the rig its tracks, or choose a stereo estimator"
            )
        announce()
        tracks = TrackModel(
            rig.tracks,
            TrackNoise(scale=track_noise, floor=track_noise_floor),
            turn_noise,
            ChassisPrior(tilt_floor=roll_pitch_prior, side_per_chord=side_slip_prior),
            rig.stereo.mount_sigma,
        )
        constant_sigmas = np.array(
            [
                track_scale_sigma,
                track_scale_sigma,
                turn_scale_sigma,
                outward_slip_sigma,
                turn_drag_sigma,
            ]
        )
        slam = InverseDepthSlam(
            rig.stereo,
            sample=sample,
            threshold_px=threshold_px,
            map_options=MapOptions(points=points, inverse_depth_sigma=inverse_depth_sigma),
            search_options=SearchOptions(),
            noise=PatchNoise(place=place_noise_px),
            constant_sigmas=constant_sigmas,
            walk=_WALK,
        )
        self._odometry = MonocularOdometry(rig.stereo, PictureTaker(corners), tracks, slam)
        errors = ConstantErrors(CONSTANT_NAMES, constant_sigmas, np.full(5, _WALK))
        self._engine = LateImages(
            self._odometry,
            partial(_make_predictor, tracks=tracks, errors=errors),
            dt=rig.dt,
            lost_after=_STALE,
            eyes=("left",),
        )

    @property
    def map(self) -> LandmarkMap:
        """Landmarks in view whose distance is known, in the frame of the start.

        Raises:
            RuntimeError: `reset` was not called yet.
        """
        return self._odometry.map

    def reset(self, observation: Observation, *, rng: np.random.Generator) -> PoseEstimate:
        """Start at pose zero, known exactly, with the corners of the first image as points."""
        return self._engine.reset(observation, rng=rng)

    def update(self, observation: Observation) -> PoseEstimate:
        """One image: algorithm 1 of Civera et al.

        Raises:
            RuntimeError: `reset` was not called yet.
            ValueError: an image that is not the rig's, or tracks that are not two numbers.
        """
        return self._engine.update(observation)


_WALK = 5e-4  # how far a constant error wanders a frame, one sigma (SPEC 1.5)
_STALE = 1.0  # s; an older image supports nothing any more


def _make_predictor(
    observation: Observation, *, tracks: TrackModel, errors: ConstantErrors
) -> TrackModelPredictor:
    return TrackModelPredictor(tracks, errors)
