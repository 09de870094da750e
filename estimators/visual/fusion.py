"""Kalman filter of tracks and relative vision (SPEC 1.5, steps 1 and 5).

State X = (x, y, heading, k_left, k_right, k_turn) at the keyframe. Vision measures the pose
RELATIVE to the keyframe, as the tracks predict it; treating a composed pose as an independent
measurement, as the paper's update does, collapses the covariance (NEES above 1e8).
"""

from dataclasses import dataclass

import numpy as np

from grouser.estimators.visual.prediction import SCALES, Increment
from grouser.geometry import Array, between, compose, compose_jacobians, wrap

SLIP_GATE = 16.3
"""chi-square of 3 degrees of freedom at 99.9 %: beyond it the tracks are said to slip."""
_SLIP_INFLATION = 100.0
_COAST_INFLATION = 4.0


@dataclass(frozen=True, slots=True)
class FilterState:
    """Pose and scale errors with their joint covariance."""

    pose: Array
    """(3,)"""
    scales: Array
    """(SCALES,)"""
    covariance: Array
    """(3 + SCALES, 3 + SCALES)"""


@dataclass(frozen=True, slots=True)
class Accumulated:
    """What was predicted since the keyframe."""

    pose: Array
    """(3,) relative to the keyframe"""
    covariance: Array
    """(3, 3) of the increments' white noise"""
    by_scales: Array
    """(3, SCALES)"""
    frames: int

    def then(self, increment: Increment) -> "Accumulated":
        """One more increment."""
        F, V = compose_jacobians(self.pose, increment.pose)
        covariance = F @ self.covariance @ F.T + V @ increment.covariance @ V.T
        by_scales = F @ self.by_scales + V @ increment.by_scales
        pose = compose(self.pose, increment.pose)
        return Accumulated(pose, covariance, by_scales, self.frames + 1)


NOTHING_YET = Accumulated(np.zeros(3), np.zeros((3, 3)), np.zeros((3, SCALES)), 0)


@dataclass(frozen=True, slots=True)
class Fused:
    """The state after prediction and, where there was one, measurement."""

    state: FilterState
    nis: float
    """Squared innovation over its covariance; NaN where nothing was compared."""
    slipped: bool
    """The tracks disagreed with vision beyond the gate."""


class RelativeFilter:
    """Fuses what the tracks say of the motion since the keyframe with what vision says of it."""

    def __init__(self, *, scale_sigmas: Array, scale_walk: float) -> None:
        """
        Args:
            scale_sigmas: (SCALES,) sigma of the scale errors at the start.
            scale_walk: how far a scale error wanders in one frame, one sigma.
        """
        self._walk = scale_walk
        covariance = np.diag(np.concatenate([np.zeros(3), scale_sigmas**2]))
        self.keyframe = FilterState(np.zeros(3), np.zeros(SCALES), covariance)

    def coast(self, predicted: Accumulated) -> Fused:
        """Prediction alone, trusted less, as whatever blinds the camera may shake the robot too."""
        pose, covariance, _, _ = self._predict(predicted, _COAST_INFLATION)
        return Fused(FilterState(pose, self.keyframe.scales, covariance), np.nan, False)

    def follow(self, measured: Array, noise: Array) -> Fused:
        """Measurement alone: pose (3,) relative to the keyframe and its covariance (3, 3)."""
        seen = Accumulated(measured, noise, np.zeros((3, SCALES)), 0)
        pose, covariance, _, _ = self._predict(seen, 1.0)
        return Fused(FilterState(pose, self.keyframe.scales, covariance), np.nan, False)

    def fuse(self, predicted: Accumulated, measured: Array, noise: Array) -> Fused:
        """Both; where they disagree beyond the gate the tracks slipped, and vision wins."""
        fused = self._update(predicted, measured, noise, 1.0)
        if fused.nis <= SLIP_GATE:
            return fused
        again = self._update(predicted, measured, noise, _SLIP_INFLATION)
        return Fused(again.state, fused.nis, True)

    def _update(
        self, predicted: Accumulated, measured: Array, noise: Array, inflation: float
    ) -> Fused:
        pose, covariance, cross, spread = self._predict(predicted, inflation)
        innovation = measured - predicted.pose
        innovation[2] = wrap(innovation[2])
        S = spread + noise
        K = np.linalg.solve(S, cross.T).T
        change = K @ innovation
        covariance = covariance - K @ S @ K.T
        pose = np.append(pose[:2] + change[:2], wrap(pose[2] + change[2]))
        scales = self.keyframe.scales + change[3:]
        nis = float(innovation @ np.linalg.solve(S, innovation))
        return Fused(FilterState(pose, scales, (covariance + covariance.T) / 2), nis, False)

    def relative(self, fused: Fused) -> Array:
        """(3,) the fused pose as seen from the keyframe."""
        return between(self.keyframe.pose, fused.state.pose)

    def commit(self, fused: Fused) -> None:
        """The current frame becomes the keyframe."""
        self.keyframe = fused.state

    def _predict(
        self, predicted: Accumulated, inflation: float
    ) -> tuple[Array, Array, Array, Array]:
        """Pose, covariance of the state, cross covariance with the measurement, and its spread."""
        R_pose, R_rel = compose_jacobians(self.keyframe.pose, predicted.pose)
        n = 3 + SCALES
        F, H = np.eye(n), np.zeros((3, n))
        F[:3, :3], F[:3, 3:] = R_pose, R_rel @ predicted.by_scales
        H[:, 3:] = predicted.by_scales
        Q = inflation * predicted.covariance
        P = self.keyframe.covariance
        covariance = F @ P @ F.T
        covariance[:3, :3] += R_rel @ Q @ R_rel.T
        covariance[3:, 3:] += predicted.frames * self._walk**2 * np.eye(SCALES)
        cross = F @ P @ H.T
        cross[:3] += R_rel @ Q
        return compose(self.keyframe.pose, predicted.pose), covariance, cross, H @ P @ H.T + Q
