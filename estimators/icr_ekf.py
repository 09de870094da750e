"""Tracks whose instantaneous centres of rotation are estimated online."""

from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np

from grouser.estimators.base import Observation, PoseEstimate, PoseEstimator, Status
from grouser.estimators.gyro import Gyro, GyroOptions
from grouser.estimators.icr_predictor import IcrOptions, IcrPredictor, tell_centres
from grouser.estimators.joint_filter import POSITION_GATE, Heard, JointFilter, JointFused
from grouser.estimators.pose_source import PoseSource
from grouser.estimators.position_fixes import PositionFixes
from grouser.estimators.track_motion import observed_increments
from grouser.estimators.visual.fusion import RelativePose
from grouser.geometry import between
from grouser.rig import Rig


class IcrEkf(PoseEstimator):
    """Kinematics of Martinez and Mandow (2005) in the filter of Pentzer et al. (2014).

    The tracks predict; what else there is corrects the pose and, with it, the centres: another
    estimator as `source`, which then must do without the tracks; the gyroscope; satellite fixes.
    Without any of them this is dead reckoning on the prior centres.

    TRACKING where the source tracks or a fix came within the last second, else COASTING.
    Diagnostics: `icr_left`, `icr_right`, `icr_x`, `effective_width` [m] of the present course, each
    with a `_sigma`; `gyro_bias` [rad/s]; `nis` of the source's motion, `slipped` where it or the
    gyroscope disagreed with the tracks, `fix_rejected`.
    """

    requires: ClassVar[frozenset[str]] = frozenset({"tracks", "stamp"})
    optional: ClassVar[frozenset[str]] = frozenset({"left", "right", "lidar", "imu", "gps"})

    def __init__(
        self,
        rig: Rig,
        *,
        source: str | None = None,
        source_options: Mapping[str, Any] | None = None,
        use_imu: bool = True,
        use_gps: bool = True,
        icr: IcrOptions | None = None,
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
        _require_positive(
            anchor_distance=anchor_distance, anchor_turn=anchor_turn, fix_lasts=fix_lasts
        )
        self._tracks, self._icr_options = rig.tracks, icr or IcrOptions()
        self._predictor = IcrPredictor(self._tracks, self._icr_options)
        self._imu = rig.imu if use_imu else None
        self._gps = rig.gps if use_gps else None
        self._gyro_options, self._dt = gyro or GyroOptions(), rig.dt
        self._source = None if source is None else PoseSource(source, rig, source_options or {})
        self._anchor_distance, self._anchor_turn = anchor_distance, anchor_turn
        self._fix_lasts = fix_lasts
        self._filter: JointFilter | None = None

    def reset(self, observation: Observation, *, rng: np.random.Generator) -> PoseEstimate:
        """Start at pose zero, known exactly, the centres as the rig's effective width says.

        Raises:
            ValueError: the observation lacks what the source requires.
        """
        self._predictor = IcrPredictor(self._tracks, self._icr_options)
        self._filter = JointFilter(
            self._predictor.errors,
            gyro=Gyro(self._imu, self._dt, self._gyro_options)
            if self._imu and "imu" in observation
            else None,
            fixes=PositionFixes(self._gps) if self._gps and "gps" in observation else None,
        )
        self._filter.reset(observation)
        self._fixed_at = -np.inf
        if self._source:
            self._source.reset(observation, rng=rng)
        start = self._filter.coast()
        status = Status.TRACKING if self._source else Status.COASTING
        return self._estimate(observation, start, Heard(), status)

    def update(self, observation: Observation) -> PoseEstimate:
        """Predict by the tracks, hear gyroscope and receiver, look where the source says one is.

        Raises:
            RuntimeError: `reset` was not called yet.
            ValueError: the increments are not two finite numbers, or the source refuses what it is
                shown.
        """
        if self._filter is None:
            raise RuntimeError("call reset() with the first observation before update()")
        biases, _ = self._filter.of_predictor()
        self._filter.predict(self._predictor.predict(observation, biases))
        heard = self._filter.hear(observation)
        fused, sourced = self._look(self._filter, observation)
        if heard.fixed:
            self._fixed_at = float(observation["stamp"][0])
        supported = sourced or self._fix_is_young(observation)
        status = Status.TRACKING if supported else Status.COASTING
        return self._estimate(observation, fused, heard, status)

    def _look(self, joint: JointFilter, observation: Observation) -> tuple[JointFused, bool]:
        """The estimate with the source's motion, and whether there was one."""
        if self._source is None or not self._source.update(observation):
            fused = joint.coast()
            joint.commit(fused)  # there is no motion that a later one would have to replace
            return fused, False
        pose, covariance = self._source.relative()
        fused = joint.fuse(RelativePose(pose, covariance, by_disparity=np.zeros(3)))
        moved = between(fused.state.keyframe, fused.state.pose)
        far = np.hypot(moved[0], moved[1]) > self._anchor_distance
        if far or abs(moved[2]) > self._anchor_turn:
            joint.commit(fused)
            self._source.anchor()
        return fused, True

    def _fix_is_young(self, observation: Observation) -> bool:
        return float(observation["stamp"][0]) - self._fixed_at < self._fix_lasts + self._dt / 2

    def _estimate(
        self, observation: Observation, fused: JointFused, heard: Heard, status: Status
    ) -> PoseEstimate:
        assert self._filter is not None
        n, state = len(self._predictor.errors), fused.state
        centres = self._predictor.centres(
            observed_increments(observation), state.biases[:n], state.bias_covariance[:n, :n]
        )
        diagnostics = tell_centres(*centres) | {
            "gyro_bias": self._filter.gyro_bias[0],
            "nis": fused.nis,
            "slipped": float(fused.slipped or heard.slipped),
            "fix_rejected": float(heard.fix_nis > POSITION_GATE),
        }
        return PoseEstimate(
            pose=state.pose.copy(),
            covariance=state.pose_covariance,
            status=status,
            stamp=float(observation["stamp"][0]),
            diagnostics=diagnostics,
        )


def _require_positive(**values: float) -> None:
    for name, value in values.items():
        if not (np.isfinite(value) and value > 0):
            raise ValueError(f"{name} must be positive and finite, got {value!r}")
