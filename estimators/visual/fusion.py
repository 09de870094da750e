"""Kalman filter of tracks and relative vision (SPEC 1.5, steps 1 and 5).

State X = (x, y, heading, biases) at the keyframe; the biases are the constant errors of whatever
predicts and, last, the disparity offset, which makes all of vision's distances too long or too
short. Vision measures the
pose RELATIVE to the keyframe, as the tracks predict it; treating a composed pose as an independent
measurement, as the paper's update does, collapses the covariance (NEES above 1e8).
"""

from dataclasses import dataclass

import numpy as np

from grouser.estimators.visual.constant_errors import ConstantErrors, disparity_offset
from grouser.estimators.visual.prediction import Increment
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
    """(n + 1,) the predictor's constant errors and the disparity offset"""
    covariance: Array
    """(3 + n + 1, 3 + n + 1)"""


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
    """(3, n) by the predictor's constant errors"""
    frames: int

    def then(self, increment: Increment) -> "Accumulated":
        """One more increment."""
        F, V = compose_jacobians(self.pose, increment.pose)
        covariance = F @ self.covariance @ F.T + V @ increment.covariance @ V.T
        by_biases = F @ self.by_biases + V @ increment.by_biases
        pose = compose(self.pose, increment.pose)
        return Accumulated(pose, covariance, by_biases, self.frames + 1)


def nothing_yet(errors: ConstantErrors) -> Accumulated:
    """At the keyframe itself, for a predictor with these constant errors."""
    return Accumulated(np.zeros(3), np.zeros((3, 3)), np.zeros((3, len(errors))), 0)


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

    def __init__(self, errors: ConstantErrors, *, disparity_sigma: float) -> None:
        """
        Args:
            errors: the predictor's.
            disparity_sigma: how well the disparity offset is known, one sigma [px].
        """
        every = errors + disparity_offset(disparity_sigma)
        self._predicted = len(errors)
        self._walk = np.diag(every.walks) ** 2
        covariance = np.diag(np.concatenate([np.zeros(3), every.sigmas**2]))
        self.keyframe = FilterState(np.zeros(3), np.zeros(len(every)), covariance)

    def of_predictor(self) -> tuple[Array, Array]:
        """The predictor's constant errors (n,) as estimated, and their covariance (n, n)."""
        own = slice(3, 3 + self._predicted)
        return self.keyframe.biases[: self._predicted], self.keyframe.covariance[own, own]

    def coast(self, predicted: Accumulated) -> Fused:
        """Prediction alone, trusted less, as whatever blinds the camera may shake the robot too."""
        pose, covariance, _ = self._predict(predicted, _COAST_INFLATION)
        state = self._wandered(pose, self.keyframe.biases, covariance, predicted.frames)
        return Fused(state, np.nan, False)

    def follow(self, measured: RelativePose, frames: int) -> Fused:
        """Measurement alone, after so many frames."""
        pose, covariance, _ = self._composed(
            self._corrected(measured), measured.covariance, -self._by_biases(measured)
        )
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
        H = self._by_all_biases(predicted) + self._by_biases(measured)
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
        return measured.pose - self._by_biases(measured) @ self.keyframe.biases

    def relative(self, fused: Fused) -> Array:
        """(3,) the fused pose as seen from the keyframe."""
        return between(self.keyframe.pose, fused.state.pose)

    def commit(self, fused: Fused) -> None:
        """The current frame becomes the keyframe."""
        self.keyframe = fused.state

    def _predict(self, predicted: Accumulated, inflation: float) -> tuple[Array, Array, Array]:
        noise = inflation * predicted.covariance
        return self._composed(predicted.pose, noise, self._by_all_biases(predicted))

    def _composed(
        self, relative: Array, noise: Array, by_biases: Array
    ) -> tuple[Array, Array, Array]:
        """Pose, covariance of the state, and the pose's derivative by the relative pose (3,)."""
        R_pose, R_rel = compose_jacobians(self.keyframe.pose, relative)
        F = np.eye(3 + len(self.keyframe.biases))
        F[:3, :3], F[:3, 3:] = R_pose, R_rel @ by_biases
        covariance = F @ self.keyframe.covariance @ F.T
        covariance[:3, :3] += R_rel @ noise @ R_rel.T
        return compose(self.keyframe.pose, relative), covariance, R_rel

    def _by_all_biases(self, predicted: Accumulated) -> Array:
        """(3, n + 1) of what was predicted."""
        return np.column_stack([predicted.by_biases, np.zeros(3)])

    def _by_biases(self, measured: RelativePose) -> Array:
        """(3, n + 1) error of what vision measured per unit of the biases."""
        return np.column_stack([np.zeros((3, self._predicted)), measured.by_disparity])
