"""Kalman filter of tracks and relative vision (SPEC 1.5, steps 1 and 5).

State X = (x, y, heading, biases) at the keyframe; the biases are the tracks' scale errors and the
disparity offset, which makes all of vision's distances too long or too short. Vision measures the
pose RELATIVE to the keyframe, as the tracks predict it; treating a composed pose as an independent
measurement, as the paper's update does, collapses the covariance (NEES above 1e8).
"""

from dataclasses import dataclass

import numpy as np

from grouser.estimators.visual.prediction import BIASES, Increment
from grouser.geometry import Array, between, compose, compose_jacobians, wrap

SLIP_GATE = 16.3
"""chi-square of 3 degrees of freedom at 99.9 %: beyond it the tracks are said to slip."""
_SLIP_INFLATION = 100.0
_COAST_INFLATION = 4.0


@dataclass(frozen=True, slots=True)
class FilterState:
    """Pose and biases with their joint covariance."""

    pose: Array
    """(3,)"""
    biases: Array
    """(BIASES,)"""
    covariance: Array
    """(3 + BIASES, 3 + BIASES)"""


@dataclass(frozen=True, slots=True)
class RelativePose:
    """What vision measured: the pose relative to the keyframe."""

    pose: Array
    """(3,)"""
    covariance: Array
    """(3, 3) of its independent noise"""
    by_disparity: Array
    """(3,) its error per px of disparity offset"""


@dataclass(frozen=True, slots=True)
class Accumulated:
    """What was predicted since the keyframe."""

    pose: Array
    """(3,) relative to the keyframe"""
    covariance: Array
    """(3, 3) of the increments' white noise"""
    by_biases: Array
    """(3, BIASES)"""
    frames: int

    def then(self, increment: Increment) -> "Accumulated":
        """One more increment."""
        F, V = compose_jacobians(self.pose, increment.pose)
        covariance = F @ self.covariance @ F.T + V @ increment.covariance @ V.T
        by_biases = F @ self.by_biases + V @ increment.by_biases
        pose = compose(self.pose, increment.pose)
        return Accumulated(pose, covariance, by_biases, self.frames + 1)


NOTHING_YET = Accumulated(np.zeros(3), np.zeros((3, 3)), np.zeros((3, BIASES)), 0)


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

    def __init__(self, *, bias_sigmas: Array, scale_walk: float) -> None:
        """
        Args:
            bias_sigmas: (BIASES,) sigma of the biases at the start.
            scale_walk: how far a track's scale error wanders in one frame, one sigma.
        """
        self._walk = np.diag([scale_walk, scale_walk, scale_walk, 0.0]) ** 2
        covariance = np.diag(np.concatenate([np.zeros(3), bias_sigmas**2]))
        self.keyframe = FilterState(np.zeros(3), np.zeros(BIASES), covariance)

    def coast(self, predicted: Accumulated) -> Fused:
        """Prediction alone, trusted less, as whatever blinds the camera may shake the robot too."""
        pose, covariance, _ = self._predict(predicted, _COAST_INFLATION)
        state = self._wandered(pose, self.keyframe.biases, covariance, predicted.frames)
        return Fused(state, np.nan, False)

    def follow(self, measured: RelativePose, frames: int) -> Fused:
        """Measurement alone, after so many frames."""
        seen = Accumulated(
            self._corrected(measured),
            measured.covariance,
            -_by_biases(measured),
            frames,
        )
        pose, covariance, _ = self._predict(seen, 1.0)
        state = self._wandered(pose, self.keyframe.biases, covariance, frames)
        return Fused(state, np.nan, False)

    def fuse(self, predicted: Accumulated, measured: RelativePose) -> Fused:
        """Both; where they disagree beyond the gate the tracks slipped, and vision wins."""
        fused = self._update(predicted, measured, 1.0)
        if fused.nis <= SLIP_GATE:
            return fused
        again = self._update(predicted, measured, _SLIP_INFLATION)
        return Fused(again.state, fused.nis, True)

    def _update(self, predicted: Accumulated, measured: RelativePose, inflation: float) -> Fused:
        pose, covariance, R_rel = self._predict(predicted, inflation)
        innovation = self._corrected(measured) - predicted.pose
        innovation[2] = wrap(innovation[2])
        # The innovation's error: tracks' and vision's biases, the tracks' noise, vision's noise.
        P_biases = covariance[:, 3:]
        H = predicted.by_biases + _by_biases(measured)
        Q = inflation * predicted.covariance
        cross = P_biases @ H.T
        cross[:3] += R_rel @ Q
        S = H @ covariance[3:, 3:] @ H.T + Q + measured.covariance
        K = np.linalg.solve(S, cross.T).T
        change = K @ innovation
        covariance = covariance - K @ S @ K.T
        pose = np.append(pose[:2] + change[:2], wrap(pose[2] + change[2]))
        biases = self.keyframe.biases + change[3:]
        state = self._wandered(pose, biases, covariance, predicted.frames)
        return Fused(state, float(innovation @ np.linalg.solve(S, innovation)), False)

    def _wandered(self, pose: Array, biases: Array, covariance: Array, frames: int) -> FilterState:
        """The state once the biases have wandered on, to hold from this frame."""
        covariance = (covariance + covariance.T) / 2
        covariance[3:, 3:] += frames * self._walk
        return FilterState(pose, biases, covariance)

    def _corrected(self, measured: RelativePose) -> Array:
        return measured.pose - _by_biases(measured) @ self.keyframe.biases

    def relative(self, fused: Fused) -> Array:
        """(3,) the fused pose as seen from the keyframe."""
        return between(self.keyframe.pose, fused.state.pose)

    def commit(self, fused: Fused) -> None:
        """The current frame becomes the keyframe."""
        self.keyframe = fused.state

    def _predict(self, predicted: Accumulated, inflation: float) -> tuple[Array, Array, Array]:
        """Pose, covariance of the state, and the pose's derivative by the relative pose."""
        R_pose, R_rel = compose_jacobians(self.keyframe.pose, predicted.pose)
        F = np.eye(3 + BIASES)
        F[:3, :3], F[:3, 3:] = R_pose, R_rel @ predicted.by_biases
        covariance = F @ self.keyframe.covariance @ F.T
        covariance[:3, :3] += R_rel @ (inflation * predicted.covariance) @ R_rel.T
        return compose(self.keyframe.pose, predicted.pose), covariance, R_rel


def _by_biases(measured: RelativePose) -> Array:
    """(3, BIASES) error of what vision measured per unit of the biases."""
    return np.column_stack([np.zeros((3, BIASES - 1)), measured.by_disparity])
