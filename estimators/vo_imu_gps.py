"""Visual odometry, an inertial unit and satellite fixes in a Kalman filter."""

from collections.abc import Mapping
from functools import partial
from typing import Any, ClassVar

import numpy as np

from grouser.estimators.base import Observation, PoseEstimate, PoseEstimator
from grouser.estimators.coupled_odometry import CoupledOdometry, CouplingOptions
from grouser.estimators.cruise_predictor import CruisePredictor
from grouser.estimators.felt_tracks import felt_tracks
from grouser.estimators.gyro import Gyro, GyroOptions
from grouser.estimators.icr_predictor import IcrOptions
from grouser.estimators.inclination import Inclination
from grouser.estimators.inclined_predictor import InclinedPredictor
from grouser.estimators.late_fusion import LateFusion
from grouser.estimators.pose_source import PoseSource
from grouser.estimators.slope import SlopeOptions
from grouser.estimators.stall import StallingPredictor
from grouser.estimators.visual.prediction import MotionPredictor
from grouser.rig import Imu, Rig, TrackGeometry


class VoImuGps(PoseEstimator):
    """Zhu et al. (reference [6] of the first paper), with what they leave out kept apart.

    Loosely coupled: visual odometry that sees neither tracks nor imu says how the robot moved since
    a keyframe; the gyroscope, whose bias is a state, how it turned about the vertical; fixes, where
    it is. Where there are tracks they say the way, about centres of rotation that are estimated,
    with creep and slip on slopes, as in icr-ekf; otherwise it goes on at the speed that it had. In
    the dark the gyroscope therefore holds the heading, and fixes bound the position.

    The accelerometer is not integrated to a speed: it tells the vertical to 0.01 rad, which are
    0.1 m/s^2, after 2 s more than what any track slips. It is heard, too, where the robot loses its
    speed at once and its tracks do not (`stalled` in the diagnostics): it was stopped by a wall,
    and stands until vision sees it move, or its tracks slow down.

    Images may come late, seldom, or one eye before the other: where an observation says so
    (`left_stamp` ...), all else waits for them, and from the last pair it leads on to now.

    A fix is used once, when it is new; one that comes late is carried on by the motion since. One
    beyond the gate is rejected, and `fix_rejected` says so.
    """

    requires: ClassVar[frozenset[str]] = frozenset({"left", "right", "imu", "stamp"})
    optional: ClassVar[frozenset[str]] = frozenset({"tracks", "gps"})

    def __init__(
        self,
        rig: Rig,
        *,
        vision: str = "one-point-ransac",
        vision_options: Mapping[str, Any] | None = None,
        use_tracks: bool = True,
        use_gps: bool = True,
        watch_stalls: bool = True,
        icr: IcrOptions | None = None,
        slope: SlopeOptions | None = None,
        gyro: GyroOptions | None = None,
        anchor_distance: float = 0.25,
        anchor_turn: float = 0.2,
        fix_lasts: float = 1.0,
        lost_after: float = 1.0,
    ) -> None:
        """
        Args:
            rig: the calibration; `stereo` and `imu` are needed, `tracks` and `gps` used where there
                are any.
            vision: name of the visual odometry.
            vision_options: options of it.
            use_tracks: whether tracks predict the way where there are any.
            use_gps: whether satellite fixes correct the position.
            watch_stalls: whether the accelerometer may say that the tracks spin on the spot.
            icr: how uncertain the tracks and their centres are.
            slope: how far tracks creep and slip on slopes.
            gyro: how uncertain the gyroscope is.
            anchor_distance: m after which vision's motion is taken into account for good.
            anchor_turn: rad after which it is.
            fix_lasts: s for which a fix supports the estimate.
            lost_after: s without vision, tracks and fixes until the pose is LOST.

        Raises:
            ValueError: the rig lacks a stereo camera or an imu; an option out of range; visual
                odometry that is unknown or needs tracks.
        """
        if rig.imu is None:
            raise ValueError(
                "vo-imu-gps needs rig.imu, and this rig has None; pass an override such as "
                "rig={'imu': Imu(sigma_acceleration=..., sigma_rate=...)}, or choose "
                "'one-point-ransac'"
            )
        tracks = rig.tracks if use_tracks else None
        fusion = CoupledOdometry(
            rig,
            make_parts=partial(
                _make_parts,
                tracks=tracks,
                imu=rig.imu,
                dt=rig.dt,
                icr=icr or IcrOptions(),
                slope=slope or SlopeOptions(),
                gyro=gyro or GyroOptions(),
                watch_stalls=watch_stalls,
            ),
            source=PoseSource(vision, rig, vision_options or {}),
            use_gps=use_gps,
            options=CouplingOptions(
                anchor_distance=anchor_distance,
                anchor_turn=anchor_turn,
                fix_lasts=fix_lasts,
                lost_after=lost_after,
            ),
        )
        self._engine = LateFusion(fusion)

    def reset(self, observation: Observation, *, rng: np.random.Generator) -> PoseEstimate:
        """Start at pose zero, known exactly."""
        return self._engine.reset(observation, rng=rng)

    def update(self, observation: Observation) -> PoseEstimate:
        """Predict, and correct by the gyroscope's turn, a fix and vision's motion.

        Raises:
            RuntimeError: `reset` was not called yet.
            ValueError: images that are not the rig's, or tracks that are not finite.
        """
        return self._engine.update(observation)


def _make_parts(
    observation: Observation,
    *,
    tracks: TrackGeometry | None,
    imu: Imu,
    dt: float,
    icr: IcrOptions,
    slope: SlopeOptions,
    gyro: GyroOptions,
    watch_stalls: bool,
) -> tuple[MotionPredictor, Gyro]:
    """By the tracks, where there are any; and the gyroscope."""
    if tracks is None or "tracks" not in observation:
        inclination = Inclination(imu, observation)
        predictor = InclinedPredictor(CruisePredictor(dt), inclination)
        return predictor, Gyro(imu, dt, gyro, inclination)
    by_tracks, levelled = felt_tracks(
        observation, tracks=tracks, imu=imu, dt=dt, icr=icr, slope=slope, gyro=gyro
    )
    # A stop lasts a few steps: an imu that is slower or late would tell it from nothing.
    felt = watch_stalls and "imu_stamp" not in observation
    return (StallingPredictor(by_tracks, dt) if felt else by_tracks), levelled
