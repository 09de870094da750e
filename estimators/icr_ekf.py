"""Tracks whose instantaneous centres of rotation are estimated online."""

from collections.abc import Mapping
from functools import partial
from typing import Any, ClassVar

import numpy as np

from grouser.estimators.base import Observation, PoseEstimate, PoseEstimator
from grouser.estimators.coupled_odometry import CoupledOdometry, CouplingOptions
from grouser.estimators.felt_tracks import felt_tracks
from grouser.estimators.gyro import Gyro, GyroOptions
from grouser.estimators.icr_predictor import IcrOptions, IcrPredictor
from grouser.estimators.late_fusion import LateFusion
from grouser.estimators.pose_source import PoseSource
from grouser.estimators.slope import SlopeOptions
from grouser.estimators.slope_predictor import UnknownSlopePredictor
from grouser.estimators.visual.prediction import MotionPredictor
from grouser.rig import Imu, Rig, TrackGeometry


class IcrEkf(PoseEstimator):
    """Kinematics of Martinez and Mandow (2005) in the filter of Pentzer et al. (2014).

    The tracks predict; what else there is corrects the pose and, with it, the centres: another
    estimator as `source`, which then must do without the tracks; the gyroscope; satellite fixes.
    Without any of them this is dead reckoning on the prior centres.

    TRACKING where the source tracks or a fix came within the last second, else COASTING.
    Diagnostics: `icr_left`, `icr_right`, `icr_x`, `effective_width` [m] of the present course, and
    `creep` [m/rad over the sine of a slope] with an imu, each with a `_sigma`; `gyro_bias` [rad/s];
    `nis` of the source's motion, `slipped` where it or the gyroscope disagreed with the tracks,
    `fix_rejected`.
    """

    requires: ClassVar[frozenset[str]] = frozenset({"tracks", "stamp"})
    optional: ClassVar[frozenset[str]] = frozenset({"left", "right", "lidar", "imu", "gps"})
    optional_for_source: ClassVar[frozenset[str]] = frozenset({"left", "right", "lidar"})

    def __init__(
        self,
        rig: Rig,
        *,
        source: str | None = None,
        source_options: Mapping[str, Any] | None = None,
        use_imu: bool = True,
        use_gps: bool = True,
        icr: IcrOptions | None = None,
        slope: SlopeOptions | None = None,
        gyro: GyroOptions | None = None,
        anchor_distance: float = 0.25,
        anchor_turn: float = 0.2,
        fix_lasts: float = 1.0,
    ) -> None:
        """
        Args:
            rig: the calibration; `tracks` is needed, `imu` and `gps` used where there are any.
            source: name of an estimator that says how the robot moves.
            source_options: options of it.
            use_imu: whether the gyroscope's turn corrects that of the tracks.
            use_gps: whether satellite fixes correct the position.
            icr: how uncertain the centres and the tracks are.
            slope: how far tracks creep and slip on slopes, and on what slopes to reckon with where
                there is no inertial unit that tells them.
            gyro: how uncertain the gyroscope's bias is.
            anchor_distance: m after which the source's motion is taken into account for good.
            anchor_turn: rad after which it is.
            fix_lasts: s for which a fix supports the estimate.

        Raises:
            ValueError: the rig says nothing about tracks; an option out of range; a source that is
                unknown, or that cannot do without tracks.
        """
        if rig.tracks is None:
            raise ValueError(
                "icr-ekf needs rig.tracks, and this rig has None; pass an override such as "
                "rig={'tracks': TrackGeometry(gauge=..., width=..., effective_width=...)}"
            )
        coupling = CouplingOptions(
            anchor_distance=anchor_distance, anchor_turn=anchor_turn, fix_lasts=fix_lasts
        )
        fusion = CoupledOdometry(
            rig,
            make_parts=partial(
                _make_parts,
                tracks=rig.tracks,
                imu=rig.imu if use_imu else None,
                dt=rig.dt,
                icr=icr or IcrOptions(),
                slope=slope or SlopeOptions(),
                gyro=gyro or GyroOptions(),
            ),
            source=None if source is None else PoseSource(source, rig, source_options or {}),
            use_gps=use_gps,
            options=coupling,
        )
        self._engine = LateFusion(fusion)

    def reset(self, observation: Observation, *, rng: np.random.Generator) -> PoseEstimate:
        """Start at pose zero, known exactly, the centres as the rig's effective width says.

        Raises:
            ValueError: the observation lacks what the source requires.
        """
        return self._engine.reset(observation, rng=rng)

    def update(self, observation: Observation) -> PoseEstimate:
        """Predict by the tracks, and correct by what else there is.

        Raises:
            RuntimeError: `reset` was not called yet.
            ValueError: the increments are not two finite numbers, or the source refuses what it is
                shown.
        """
        return self._engine.update(observation)


def _make_parts(
    observation: Observation,
    *,
    tracks: TrackGeometry,
    imu: Imu | None,
    dt: float,
    icr: IcrOptions,
    slope: SlopeOptions,
    gyro: GyroOptions,
) -> tuple[MotionPredictor, Gyro | None]:
    """What predicts, and the gyroscope, where there is one."""
    if imu is None or "imu" not in observation:
        on_level = IcrPredictor(tracks, icr)
        return UnknownSlopePredictor(on_level, tracks.effective_width, slope), None
    return felt_tracks(observation, tracks=tracks, imu=imu, dt=dt, icr=icr, slope=slope, gyro=gyro)
