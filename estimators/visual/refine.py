"""Errors-in-variables refinement of a chassis motion on matched points (SPEC 1.5 step 4, 1.6).

Both frames' measurements are noisy. A plain reprojection error evaluated at the noisy reference
point is biased at sub-pixel motion, so every point carries a corrected position that is estimated
with the motion. Planarity and the non-holonomic constraint enter as priors with a sigma.
"""

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from grouser.estimators.visual.motion import COMPILED, camera_motion, measure
from grouser.estimators.visual.prior import MotionPrior
from grouser.geometry import Array

GATE = 11.34
"""chi-square of 3 degrees of freedom at 99 %: the inlier limit of a point's (u, v, d) error."""
CAUCHY = 3.0
"""Squared error at which a point's weight has halved."""


@dataclass(frozen=True, slots=True)
class Refinement:
    """A refined motion and what supports it."""

    motion: Array
    """(6,) as in `grouser.estimators.visual.motion`."""
    covariance: Array
    """(6, 6) of independent pixel noise"""
    by_disparity: Array
    """(6,) error of the motion per px by which all disparities are off: it does not average out"""
    inliers: NDArray[np.bool_]
    """(n,)"""
    noise_ratio: float
    """Robust squared error of the inliers over what the assumed pixel noise makes expected."""
    iterations: int


def refine(
    reference: Array,
    current: Array,
    *,
    start: Array,
    supporters: NDArray[np.bool_],
    prior: MotionPrior,
    noise: Array,
    T_base_camera: Array,
    camera: Array,
    iterations: int = 8,
) -> Refinement:
    """The motion that best explains matched points.

    Args:
        reference, current: (n, 3) u, v, d [px] of the same points in the two frames.
        start: (6,) first guess, good to a few pixels.
        supporters: (n,) points believed to be right; their errors tell how noisy pixels are.
        prior: of the motion; its sigmas are finite, if wide.
        noise: (6,) variances of u, v, d in the reference and in the current frame [px^2].
        T_base_camera: (4, 4) mount; camera: (5,) from `intrinsics`.
    """
    motion, covariance, by_disparity, errors, scale, steps = _gauss_newton(
        np.ascontiguousarray(reference),
        np.ascontiguousarray(current),
        start,
        np.flatnonzero(supporters),
        prior.mean,
        1.0 / prior.sigma**2,
        noise,
        T_base_camera,
        camera,
        iterations,
    )
    inliers = errors < GATE * scale
    kept = errors[inliers]
    weights = 1.0 / (1.0 + kept / (CAUCHY * scale))
    ratio = float(weights @ kept / weights.sum() / _EXPECTED_ERROR) if len(kept) else np.inf
    return Refinement(motion, covariance * _COVARIANCE_FACTOR, by_disparity, inliers, ratio, steps)


def _expectations() -> tuple[float, float]:
    """Weighted mean error, and covariance factor, of Cauchy weights on gated chi-square errors.

    The covariance of a weighted estimate is E[w^2 e] / E[w e'] ^2-like rather than the inverse of
    the weighted information; both integrals are over the chi-square density of 3 degrees.
    """
    e = np.linspace(0, GATE, 20001)[1:]
    density = np.sqrt(e) * np.exp(-e / 2)
    density /= density.sum()
    w = 1.0 / (1.0 + e / CAUCHY)
    # psi(r) = w(|r|^2) r in 3-D: mean of dpsi/dr is E[w + (2/3) e w'(e)], of psi psi^T E[w^2 e]/3
    slope = np.sum(density * (w - 2 / 3 * e * w**2 / CAUCHY))
    spread = np.sum(density * w**2 * e) / 3
    mean_weight = np.sum(density * w)
    return float(np.sum(density * w * e) / mean_weight), float(mean_weight * spread / slope**2)


_MEDIAN_ERROR = 2.366  # chi-square of 3 degrees of freedom
_SETTLED = 1e-7  # rad and m
_EXPECTED_ERROR, _COVARIANCE_FACTOR = _expectations()


@njit(**COMPILED)
def _gauss_newton(
    reference: Array,
    current: Array,
    start: Array,
    supporters: NDArray[np.int64],
    prior_mean: Array,
    prior_information: Array,
    noise: Array,
    T_base_camera: Array,
    camera: Array,
    limit: int,
) -> tuple[Array, Array, Array, Array, float, int]:
    n = reference.shape[0]
    motion = start.copy()
    corrected = reference.copy()
    errors, residual = np.zeros(n), np.empty((n, 3))
    jacobian, by_point = np.empty((n, 3, 6)), np.empty((n, 3, 3))
    information = np.empty((n, 3, 3))
    covariance, by_disparity = np.zeros((6, 6)), np.zeros(6)
    offset, unused = np.empty(3), np.empty((6, 6))
    scale, steps = 1.0, 0
    while steps < limit:
        steps += 1
        _compare(
            reference, current, corrected, motion, noise, T_base_camera, camera,
            errors, residual, jacobian, by_point, information,
        )  # fmt: skip
        # Noisier images than assumed must widen the gate, not starve the estimate.
        scale = max(1.0, np.median(errors[supporters]) / _MEDIAN_ERROR)
        H, g = np.diag(prior_information), prior_information * (prior_mean - motion)
        by_disparity[:] = 0.0
        for i in range(n):
            if errors[i] < GATE * scale:
                weight = 1.0 / (1.0 + errors[i] / (CAUCHY * scale))
                _accumulate(weight, residual[i], jacobian[i], information[i], H, g)
                # An offset of all disparities moves the measured point, and the one predicted.
                offset[:] = -by_point[i, :, 2]
                offset[2] += 1.0
                _accumulate(weight, offset, jacobian[i], information[i], unused, by_disparity)
        covariance[:] = np.linalg.inv(H)
        change = covariance @ g
        motion = motion + change
        for i in range(n):
            if errors[i] < GATE * scale:
                gain = (noise[:3] * by_point[i]).T @ information[i]
                corrected[i] = reference[i] + gain @ (residual[i] - jacobian[i] @ change)
        if np.abs(change).max() < _SETTLED:
            break
    return motion, covariance, covariance @ by_disparity, errors, scale, steps


@njit(**COMPILED)
def _compare(
    reference: Array,
    current: Array,
    corrected: Array,
    motion: Array,
    noise: Array,
    T_base_camera: Array,
    camera: Array,
    errors: Array,
    residual: Array,
    jacobian: Array,
    by_point: Array,
    information: Array,
) -> None:
    """Residuals of all points at a motion, their squared errors, Jacobians and information."""
    A, b, dA, db = camera_motion(motion, T_base_camera)
    p = np.empty(3)
    for i in range(reference.shape[0]):
        Jw = by_point[i]
        if not measure(corrected[i], A, b, dA, db, camera, p, Jw, jacobian[i]):
            errors[i] = np.inf
            continue
        residual[i] = current[i] - p - Jw @ (reference[i] - corrected[i])
        _invert_spread(Jw, noise, information[i])
        errors[i] = residual[i] @ (information[i] @ residual[i])


@njit(**COMPILED)
def _accumulate(
    weight: float, residual: Array, Jm: Array, information: Array, H: Array, g: Array
) -> None:
    """One point's part of the normal equations H dx = g."""
    weighted = np.empty((3, 6))
    for a in range(3):
        for c in range(6):
            weighted[a, c] = 0.0
            for k in range(3):
                weighted[a, c] += weight * information[a, k] * Jm[k, c]
    for a in range(6):
        for k in range(3):
            g[a] += weighted[k, a] * residual[k]
        for c in range(6):
            for k in range(3):
                H[a, c] += Jm[k, a] * weighted[k, c]


@njit(**COMPILED)
def _invert_spread(Jw: Array, noise: Array, out: Array) -> None:
    """out = (Jw diag(noise[:3]) Jw^T + diag(noise[3:]))^-1, all 3 by 3."""
    S = np.empty((3, 3))
    for a in range(3):
        for c in range(3):
            S[a, c] = noise[3 + a] if a == c else 0.0
            for k in range(3):
                S[a, c] += Jw[a, k] * noise[k] * Jw[c, k]
    for a in range(3):
        for c in range(3):
            a1, a2, c1, c2 = (a + 1) % 3, (a + 2) % 3, (c + 1) % 3, (c + 2) % 3
            out[c, a] = S[a1, c1] * S[a2, c2] - S[a1, c2] * S[a2, c1]
    determinant = S[0, 0] * out[0, 0] + S[0, 1] * out[1, 0] + S[0, 2] * out[2, 0]
    for a in range(3):
        for c in range(3):
            out[a, c] /= determinant
