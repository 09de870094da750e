"""Kalman filter of tracks and relative vision (SPEC 1.5, steps 1 and 5).

State X = (x, y, heading, biases) at the keyframe; the biases are the constant errors of whatever
predicts and, last, the disparity offset, which makes all of vision's distances too long or too
short. Vision measures the
pose RELATIVE to the keyframe, as the tracks predict it; treating a composed pose as an independent
measurement, as the paper's update does, collapses the covariance (NEES above 1e8).
"""

from dataclasses import dataclass, field, replace

import numpy as np

from grouser.estimators.visual.constant_errors import ConstantErrors, disparity_offset
from grouser.estimators.visual.prediction import Increment
from grouser.estimators.visual.single_pose import (
    between,
    carried,
    compose,
    compose_jacobians,
    wrapped,
)
from grouser.estimators.visual.track_trust import TrackTrust
from grouser.estimators.visual.variance_factor import Innovation
from grouser.geometry import Array
from grouser.kernels import kernel, kernel_using

_ITS_OWN = 2.0
"""Sigmas that a constant error has at most; what is beyond them is slip."""
SLIP_GATE = 16.3
"""chi-square of 3 degrees of freedom at 99.9 %: beyond it the tracks are said to slip."""


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

    def shifted(self, by: Array) -> "RelativePose":
        """The same with its pose shifted by (3,)."""
        return RelativePose(self.pose + by, self.covariance, self.by_disparity)


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
    measured: bool = True
    """Whether all of it was measured; what was guessed in part is not fused."""
    of_tracks: Array = field(default_factory=lambda: np.zeros((3, 3)))
    """(3, 3) the part of the covariance that the tracks themselves bring, whatever the ground."""

    def then(self, increment: Increment) -> "Accumulated":
        """One more increment."""
        F, V = compose_jacobians(self.pose, increment.pose)
        covariance = carried(F, self.covariance, V, increment.covariance)
        by_biases = F @ self.by_biases + V @ increment.by_biases
        pose = compose(self.pose, increment.pose)
        measured = self.measured and increment.measured
        of_tracks = carried(F, self.of_tracks, V, increment.of_tracks)
        return Accumulated(pose, covariance, by_biases, self.frames + 1, measured, of_tracks)

    def shifted(self, by: Array) -> "Accumulated":
        """The same with its pose shifted by (3,)."""
        # Not `replace`, which takes as long as what a filter does with it.
        return Accumulated(
            self.pose + by,
            self.covariance,
            self.by_biases,
            self.frames,
            self.measured,
            self.of_tracks,
        )


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
    innovation: Innovation | None = None
    """None where nothing was compared."""
    doubt: Array | None = None
    """(2,) how far off the truth may be, m, and rad, since the doubt began; None without doubt."""


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
        self._sigmas = errors.sigmas
        self._walk = every.walks**2
        self._doubt: Array | None = None
        self._trust = TrackTrust()
        covariance = np.diag(np.concatenate([np.zeros(3), every.sigmas**2]))
        self.keyframe = FilterState(np.zeros(3), np.zeros(len(every)), covariance)
        self._at_start = covariance.copy()
        self._at_start[-1] = 0.0  # slip says nothing of the cameras

    def of_predictor(self) -> tuple[Array, Array]:
        """The predictor's constant errors (n,) as estimated, and their covariance (n, n)."""
        own = slice(3, 3 + self._predicted)
        return self.keyframe.biases[: self._predicted], self.keyframe.covariance[own, own]

    def coast(self, predicted: Accumulated, start: FilterState | None = None) -> Fused:
        """Prediction alone. Slip that nobody sees may end: by as much it may be wrong.

        Args:
            start: the state from which it leads on; left out, that at the keyframe.
        """
        known = self._as_known(predicted, start)
        coasted = self._coasted(known, start)
        slip = self._slip((start or self.keyframe).biases)
        if not slip.any():
            return coasted
        off = known.by_biases * slip
        return self._doubted(coasted, np.array([np.linalg.norm(off[:2]), np.linalg.norm(off[2])]))

    def _slip(self, biases: Array) -> Array:
        """(n,) by how much the predictor's constant errors (n + 1,) are more than it has itself."""
        return np.maximum(np.abs(biases[: self._predicted]) - _ITS_OWN * self._sigmas, 0.0)

    def doubt(
        self, predicted: Accumulated, anchor: Array, start: FilterState | None = None
    ) -> Fused:
        """Prediction alone, where the robot may as well have stayed at the anchor (3,), a pose
        relative to the start: midway, with a covariance that covers both ends.
        """
        known = self._as_known(predicted, start)
        half = known.pose - anchor
        half[2] = wrapped(half[2])
        half /= 2
        coasted = self._coasted(replace(known, pose=anchor + half), start)
        return self._doubted(coasted, np.array([np.hypot(half[0], half[1]), abs(half[2])]))

    def _doubted(self, coasted: Fused, off: Array) -> Fused:
        """The same where the truth may also be off by (2,) m and rad, or not, from keyframe to
        keyframe: such errors add up, not their squares."""
        before = np.zeros(2) if self._doubt is None else self._doubt
        after = before + off
        # In any direction: where it went hangs on where it headed, which is doubted as well.
        added = (after**2 - before**2)[[0, 0, 1]]
        covariance = coasted.state.covariance.copy()
        covariance[:3, :3] += np.diag(added)
        return Fused(replace(coasted.state, covariance=covariance), np.nan, False, doubt=after)

    def _coasted(self, predicted: Accumulated, start: FilterState | None) -> Fused:
        noise = self._trust.in_the_dark(predicted.covariance, predicted.of_tracks)
        by_biases = self._by_all_biases(predicted)
        return self._alone(predicted.pose, noise, by_biases, predicted.frames, start)

    def _as_known(self, predicted: Accumulated, start: FilterState | None) -> Accumulated:
        """What was predicted with the constant errors known at the keyframe, with those at the
        start."""
        if start is None:
            return predicted
        better = start.biases[: self._predicted] - self.keyframe.biases[: self._predicted]
        return predicted.shifted(predicted.by_biases @ better)

    def follow(self, measured: RelativePose, frames: int) -> Fused:
        """Measurement alone, after so many frames."""
        by_biases = self._by_biases(measured)
        corrected = measured.pose - by_biases @ self.keyframe.biases
        return self._alone(corrected, measured.covariance, -by_biases, frames)

    def _alone(
        self,
        relative: Array,
        noise: Array,
        by_biases: Array,
        frames: int,
        start: FilterState | None = None,
    ) -> Fused:
        start = start or self.keyframe
        pose, covariance = _carried_on(
            start.pose, start.covariance, relative, noise, by_biases, frames * self._walk
        )
        return Fused(FilterState(pose, start.biases, covariance), np.nan, False)

    def fuse(self, predicted: Accumulated, measured: RelativePose) -> Fused:
        """Both; where they disagree beyond the gate the tracks slipped, and vision wins.

        Slip goes on or stops: the predictor's constant errors may from now on be any others.
        """
        fused = self._update(predicted, measured)
        if fused.nis <= SLIP_GATE:
            return fused
        followed = self._with_other_errors(self.follow(measured, predicted.frames).state)
        return Fused(followed, fused.nis, True, fused.innovation)

    def believe(self, fused: Fused, measured: RelativePose, frames: int) -> None:
        """This fusion, so many frames after the keyframe, is right: so good are the tracks."""
        if fused.slipped:  # and what they say of the whole way since the keyframe is as wrong
            self.keyframe = self._with_other_errors(self.keyframe)
        seen = fused.innovation
        if seen is not None:
            noise = float(seen.of_prediction[2, 2]), float(measured.covariance[2, 2])
            self._trust.watch(frames, float(seen.error[2]), *noise)

    def _with_other_errors(self, state: FilterState) -> FilterState:
        """The state where the predictor's constant errors are less sure by what they may be."""
        return replace(state, covariance=state.covariance + self._at_start)

    def _update(self, predicted: Accumulated, measured: RelativePose) -> Fused:
        keyframe = self.keyframe
        pose, biases, covariance, error, S, nis = _updated(
            keyframe.pose,
            keyframe.biases,
            keyframe.covariance,
            predicted.pose,
            predicted.covariance,
            predicted.by_biases,
            measured.pose,
            measured.covariance,
            measured.by_disparity,
            predicted.frames * self._walk,
        )
        innovation = Innovation(error, S, predicted.covariance)
        return Fused(FilterState(pose, biases, covariance), nis, False, innovation)

    def relative(self, fused: Fused, start: FilterState | None = None) -> Array:
        """(3,) the fused pose as seen from a state, by default that at the keyframe."""
        return np.asarray(between((start or self.keyframe).pose, fused.state.pose))

    def commit(self, fused: Fused) -> None:
        """The current frame becomes the keyframe."""
        self.keyframe = fused.state
        self._doubt = fused.doubt
        self._trust.end_way(fused.innovation)

    def offset(self) -> tuple[float, float]:
        """The disparity offset at the keyframe and its sigma, px."""
        return float(self.keyframe.biases[-1]), float(np.sqrt(self.keyframe.covariance[-1, -1]))

    def observe_offset(self, offset: float, sigma: float) -> None:
        """The disparity offset was measured at the keyframe, px; what followed from it follows."""
        state = self.keyframe
        P = state.covariance
        S = P[-1, -1] + sigma**2
        gain = P[:, -1] / S
        change = gain * (offset - state.biases[-1])
        pose = np.append(state.pose[:2] + change[:2], wrapped(state.pose[2] + change[2]))
        covariance = P - S * np.outer(gain, gain)
        self.keyframe = FilterState(pose, state.biases + change[3:], covariance)

    def doubt_offset(self, sigma: float) -> None:
        """The disparity offset is known no better than this, px, and nothing that it led to is."""
        state = self.keyframe
        P = state.covariance
        widened = sigma**2 - P[-1, -1]
        if widened > 0:
            led_to = P[:, -1] / P[-1, -1]
            covariance = P + widened * np.outer(led_to, led_to)
            self.keyframe = FilterState(state.pose, state.biases, covariance)

    def _by_all_biases(self, predicted: Accumulated) -> Array:
        """(3, n + 1) of what was predicted."""
        by_biases = np.zeros((3, self._predicted + 1))
        by_biases[:, :-1] = predicted.by_biases
        return by_biases

    def _by_biases(self, measured: RelativePose) -> Array:
        """(3, n + 1) error of what vision measured per unit of the biases."""
        by_biases = np.zeros((3, self._predicted + 1))
        by_biases[:, -1] = measured.by_disparity
        return by_biases


@kernel_using(compose, compose_jacobians, carried)
def _composed(
    keyframe: Array, P: Array, relative: Array, noise: Array, by_biases: Array
) -> tuple[Array, Array, Array]:
    """Pose and covariance of the state, and the pose's derivative by the relative pose (3,)."""
    R_pose, R_rel = compose_jacobians(keyframe, relative)
    F, G = np.eye(len(P)), np.zeros((len(P), 3))
    F[:3, :3], F[:3, 3:], G[:3] = R_pose, R_rel @ by_biases, R_rel
    return compose(keyframe, relative), carried(F, P, G, noise), R_rel


@kernel
def _wandered(covariance: Array, walk: Array) -> Array:
    """Symmetric, once the biases have wandered on by variances (n,), to hold from this frame."""
    covariance = (covariance + covariance.T) / 2
    for i in range(len(walk)):
        covariance[3 + i, 3 + i] += walk[i]
    return covariance


@kernel_using(_composed, _wandered)
def _carried_on(
    keyframe: Array, P: Array, relative: Array, noise: Array, by_biases: Array, walk: Array
) -> tuple[Array, Array]:
    """Pose and covariance of the state, by a relative pose alone."""
    pose, covariance, _ = _composed(keyframe, P, relative, noise, by_biases)
    return pose, _wandered(covariance, walk)


@kernel_using(_composed, _wandered, wrapped)
def _updated(
    keyframe: Array,
    biases: Array,
    P: Array,
    predicted: Array,
    Q: Array,
    by_biases: Array,
    measured: Array,
    R: Array,
    by_disparity: Array,
    walk: Array,
) -> tuple[Array, Array, Array, Array, Array, float]:
    """Pose, biases and covariance once what was predicted (with noise Q, by its own biases) and
    what was measured (with R, by the disparity offset) of the relative pose are fused; the
    innovation (3,), its covariance, and its squared length in sigmas."""
    n = len(biases)
    by_predicted, H = np.zeros((3, n)), np.empty((3, n))
    by_predicted[:, : n - 1] = by_biases
    # The innovation's error: tracks' and vision's biases, the tracks' noise, vision's noise.
    H[:, : n - 1], H[:, n - 1] = by_biases, by_disparity
    pose, covariance, R_rel = _composed(keyframe, P, predicted, Q, by_predicted)
    innovation = measured - by_disparity * biases[n - 1] - predicted
    innovation[2] = wrapped(innovation[2])
    cross = np.ascontiguousarray(covariance[:, 3:]) @ H.T
    cross[:3] += R_rel @ Q
    S = H @ np.ascontiguousarray(covariance[3:, 3:]) @ H.T + Q + R
    to_solve = np.empty((3, len(cross) + 1))
    to_solve[:, :-1], to_solve[:, -1] = cross.T, innovation
    solved = np.linalg.solve(S, to_solve)
    K = np.ascontiguousarray(solved[:, :-1].T)
    nis = float(innovation @ np.ascontiguousarray(solved[:, -1]))
    change = K @ innovation
    pose += change[:3]
    pose[2] = wrapped(pose[2])
    covariance = _wandered(covariance - K @ np.ascontiguousarray(cross.T), walk)
    return pose, biases + change[3:], covariance, innovation, S, nis
