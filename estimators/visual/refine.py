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
from grouser.geometry import Array

GATE = 11.34
"""chi-square of 3 degrees of freedom at 99 %: the inlier limit of a point's (u, v, d) error."""
CAUCHY = 9.0
"""Squared error at which a point's weight has halved."""


@dataclass(frozen=True, slots=True)
class Refinement:
    """A refined motion and what supports it."""

    motion: Array
    """(6,) as in `grouser.estimators.visual.motion`."""
    covariance: Array
    """(6, 6)"""
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
    prior_mean: Array,
    prior_sigma: Array,
    noise: Array,
    T_base_camera: Array,
    camera: Array,
    iterations: int = 8,
) -> Refinement:
    """The motion that best explains matched points.

    Args:
        reference, current: (n, 3) u, v, d [px] of the same points in the two frames.
        start: (6,) first guess, good to a few pixels.
        prior_mean, prior_sigma: (6,) priors of the motion; finite, if wide.
        noise: (6,) variances of u, v, d in the reference and in the current frame [px^2].
        T_base_camera: (4, 4) mount; camera: (5,) from `intrinsics`.
    """
    motion, covariance, errors, steps = _gauss_newton(
        np.ascontiguousarray(reference),
        np.ascontiguousarray(current),
        start,
        prior_mean,
        1.0 / prior_sigma**2,
        noise,
        T_base_camera,
        camera,
        iterations,
    )
    inliers = errors < GATE
    kept = errors[inliers]
    weights = 1.0 / (1.0 + kept / CAUCHY)
    ratio = float(weights @ kept / weights.sum() / _EXPECTED_ERROR) if len(kept) else np.inf
    return Refinement(motion, covariance * _COVARIANCE_FACTOR, inliers, ratio, steps)


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


_EXPECTED_ERROR, _COVARIANCE_FACTOR = _expectations()


@njit(**COMPILED)
def _gauss_newton(
    reference: Array,
    current: Array,
    start: Array,
    prior_mean: Array,
    prior_information: Array,
    noise: Array,
    T_base_camera: Array,
    camera: Array,
    limit: int,
) -> tuple[Array, Array, Array, int]:
    n = reference.shape[0]
    motion = start.copy()
    corrected = reference.copy()
    errors = np.zeros(n)
    residual = np.empty((n, 3))
    gain, jacobian = np.empty((n, 3, 3)), np.empty((n, 3, 6))
    covariance = np.zeros((6, 6))
    steps = 0
    for step in range(limit):
        steps = step + 1
        # The first guess may be off by pixels, and a tight gate would throw good points away.
        gate = 16 * GATE if step == 0 else GATE
        H, g = np.zeros((6, 6)), np.zeros(6)
        for k in range(6):
            H[k, k] = prior_information[k]
            g[k] = prior_information[k] * (prior_mean[k] - motion[k])
        _accumulate(
            reference, current, corrected, motion, noise, T_base_camera, camera, gate,
            errors, residual, gain, jacobian, H, g,
        )  # fmt: skip
        covariance[:] = np.linalg.inv(H)
        change = covariance @ g
        motion = motion + change
        for i in range(n):
            _correct(reference[i], residual[i], gain[i], jacobian[i], change, corrected[i])
        if step > 0 and np.abs(change).max() < 1e-8:
            break
    return motion, covariance, errors, steps


@njit(**COMPILED)
def _accumulate(
    reference: Array,
    current: Array,
    corrected: Array,
    motion: Array,
    noise: Array,
    T_base_camera: Array,
    camera: Array,
    gate: float,
    errors: Array,
    residual: Array,
    gain: Array,
    jacobian: Array,
    H: Array,
    g: Array,
) -> None:
    """Normal equations H dx = g over all points; keeps what `_correct` needs afterwards."""
    A, b, dA, db = camera_motion(motion, T_base_camera)
    p, Jw, S_inverse = np.empty(3), np.empty((3, 3)), np.empty((3, 3))
    weighted = np.empty((3, 6))
    for i in range(reference.shape[0]):
        Jm = jacobian[i]
        if not measure(corrected[i], A, b, dA, db, camera, p, Jw, Jm):
            errors[i] = np.inf
            gain[i] = 0.0
            residual[i] = 0.0
            continue
        r = residual[i]
        for a in range(3):
            r[a] = current[i, a] - p[a]
            for c in range(3):
                r[a] -= Jw[a, c] * (reference[i, c] - corrected[i, c])
        _invert_spread(Jw, noise, S_inverse)
        e = 0.0
        for a in range(3):
            for c in range(3):
                e += r[a] * S_inverse[a, c] * r[c]
        errors[i] = e
        gain[i] = 0.0  # an outlier must not drag its own corrected point away
        if not e < gate:
            continue
        for a in range(3):
            for c in range(3):
                for k in range(3):
                    gain[i, a, c] += noise[a] * Jw[k, a] * S_inverse[k, c]
        weight = 1.0 / (1.0 + e / CAUCHY)
        for a in range(3):
            for c in range(6):
                weighted[a, c] = 0.0
                for k in range(3):
                    weighted[a, c] += weight * S_inverse[a, k] * Jm[k, c]
        for a in range(6):
            for k in range(3):
                g[a] += weighted[k, a] * r[k]
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


@njit(**COMPILED)
def _correct(
    reference: Array, residual: Array, gain: Array, Jm: Array, change: Array, corrected: Array
) -> None:
    """Corrected point: reference + Sw Jw^T S^-1 (residual - Jm dx)."""
    rest = np.empty(3)
    for a in range(3):
        rest[a] = residual[a]
        for k in range(6):
            rest[a] -= Jm[a, k] * change[k]
    for a in range(3):
        corrected[a] = reference[a]
        for c in range(3):
            corrected[a] += gain[a, c] * rest[c]
