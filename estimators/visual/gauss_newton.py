"""The iteration behind `refine`: errors in variables, Cauchy weights, a gate that follows noise.

Every point carries a corrected position that is estimated with the motion (SPEC 1.6). Nothing
is allocated for a point or an iteration's points: sixty points take 8 us an iteration.
"""

import numpy as np
from numpy.typing import NDArray

from grouser.estimators.visual.motion import camera_motion
from grouser.geometry import Array
from grouser.kernels import kernel, kernel_using

GATE = 11.34
"""chi-square of 3 degrees of freedom at 99 %: the inlier limit of a point's (u, v, d) error."""
CAUCHY = 3.0
"""Squared error at which a point's weight has halved."""
MEDIAN_ERROR = 2.366  # chi-square of 3 degrees of freedom
LEAST_SCALE = 0.05  # of the assumed variances, lest points without noise shut the gate
# A step no longer matters that is so short, squared, in sigmas of the motion; or, where the points
# have no noise, in rad and m.
SETTLED_2 = 1e-4
SETTLED = 1e-7
BEHIND = 1e-6  # of a point's depth, and less: it is not in front of the camera


@kernel
def _pixel_motion(A: Array, b: Array, camera: Array, out: Array) -> None:
    """out (3, 4): A @ ray + b * i of `visual.motion` as a map of (u - cx, v - cy, d, 1), in pixels.

    The first two rows over the third are the new u - cx and v - cy.
    """
    fx, fy, baseline = camera[0], camera[1], camera[4]
    for r in range(3):
        f = fx if r == 0 else (fy if r == 1 else 1.0)
        out[r, 0], out[r, 1] = f * A[r, 0] / fx, f * A[r, 1] / fy
        out[r, 2], out[r, 3] = f * b[r] / (fx * baseline), f * A[r, 2]


@kernel
def _compare(
    reference: Array,
    current: Array,
    corrected: Array,
    N: Array,
    dN: Array,
    noise: Array,
    camera: Array,
    errors: Array,
    residual: Array,
    by_point: Array,
    by_motion: Array,
    information: Array,
) -> None:
    """Residuals of all points at a motion, their squared errors, Jacobians and information.

    Args:
        N: (3, 4) the motion from `_pixel_motion`; dN: (6, 3, 4) its derivative.
        information: (n, 6) upper triangles of (Jw diag(noise[:3]) Jw^T + diag(noise[3:]))^-1.
    """
    cx, cy = camera[2], camera[3]
    for i in range(reference.shape[0]):
        U, V, d = corrected[i, 0] - cx, corrected[i, 1] - cy, corrected[i, 2]
        Z = N[2, 0] * U + N[2, 1] * V + N[2, 2] * d + N[2, 3]
        if Z < BEHIND:
            errors[i] = np.inf
            continue
        nearer = 1.0 / Z
        U_ = (N[0, 0] * U + N[0, 1] * V + N[0, 2] * d + N[0, 3]) * nearer
        V_ = (N[1, 0] * U + N[1, 1] * V + N[1, 2] * d + N[1, 3]) * nearer
        d_ = d * nearer
        Jw, Jm = by_point[i], by_motion[i]
        for k in range(3):
            Jw[0, k] = (N[0, k] - U_ * N[2, k]) * nearer
            Jw[1, k] = (N[1, k] - V_ * N[2, k]) * nearer
            Jw[2, k] = ((1.0 if k == 2 else 0.0) - d_ * N[2, k]) * nearer
        for k in range(6):
            x = dN[k, 0, 0] * U + dN[k, 0, 1] * V + dN[k, 0, 2] * d + dN[k, 0, 3]
            y = dN[k, 1, 0] * U + dN[k, 1, 1] * V + dN[k, 1, 2] * d + dN[k, 1, 3]
            z = dN[k, 2, 0] * U + dN[k, 2, 1] * V + dN[k, 2, 2] * d + dN[k, 2, 3]
            Jm[0, k] = (x - U_ * z) * nearer
            Jm[1, k] = (y - V_ * z) * nearer
            Jm[2, k] = -d_ * z * nearer
        back_u = reference[i, 0] - corrected[i, 0]
        back_v = reference[i, 1] - corrected[i, 1]
        back_d = reference[i, 2] - d
        r0 = current[i, 0] - cx - U_ - Jw[0, 0] * back_u - Jw[0, 1] * back_v - Jw[0, 2] * back_d
        r1 = current[i, 1] - cy - V_ - Jw[1, 0] * back_u - Jw[1, 1] * back_v - Jw[1, 2] * back_d
        r2 = current[i, 2] - d_ - Jw[2, 0] * back_u - Jw[2, 1] * back_v - Jw[2, 2] * back_d
        residual[i, 0], residual[i, 1], residual[i, 2] = r0, r1, r2
        _invert_spread(Jw, noise[i], information[i])
        w = information[i]
        errors[i] = (
            r0 * (w[0] * r0 + 2 * (w[1] * r1 + w[2] * r2))
            + r1 * (w[3] * r1 + 2 * w[4] * r2)
            + w[5] * r2 * r2
        )


@kernel
def _invert_spread(Jw: Array, noise: Array, out: Array) -> None:
    """out (6,): upper triangle of (Jw diag(noise[:3]) Jw^T + diag(noise[3:]))^-1."""
    nu, nv, nd = noise[0], noise[1], noise[2]
    a0, a1, a2 = Jw[0, 0] * nu, Jw[0, 1] * nv, Jw[0, 2] * nd
    b0, b1, b2 = Jw[1, 0] * nu, Jw[1, 1] * nv, Jw[1, 2] * nd
    s00 = a0 * Jw[0, 0] + a1 * Jw[0, 1] + a2 * Jw[0, 2] + noise[3]
    s01 = a0 * Jw[1, 0] + a1 * Jw[1, 1] + a2 * Jw[1, 2]
    s02 = a0 * Jw[2, 0] + a1 * Jw[2, 1] + a2 * Jw[2, 2]
    s11 = b0 * Jw[1, 0] + b1 * Jw[1, 1] + b2 * Jw[1, 2] + noise[4]
    s12 = b0 * Jw[2, 0] + b1 * Jw[2, 1] + b2 * Jw[2, 2]
    s22 = nu * Jw[2, 0] ** 2 + nv * Jw[2, 1] ** 2 + nd * Jw[2, 2] ** 2 + noise[5]
    c00, c01, c02 = s11 * s22 - s12 * s12, s02 * s12 - s01 * s22, s01 * s12 - s02 * s11
    over = 1.0 / (s00 * c00 + s01 * c01 + s02 * c02)
    out[0], out[1], out[2] = c00 * over, c01 * over, c02 * over
    out[3], out[4] = (s00 * s22 - s02 * s02) * over, (s01 * s02 - s00 * s12) * over
    out[5] = (s00 * s11 - s01 * s01) * over


@kernel
def _accumulate(
    weight: float,
    residual: Array,
    Jw: Array,
    Jm: Array,
    w: Array,
    H: Array,
    g: Array,
    by_disparity: Array,
) -> None:
    """One point's part of the normal equations H dx = g, upper triangle, and of those for an offset
    of all disparities: it moves the measured point, and the one predicted."""
    r0, r1, r2 = residual[0], residual[1], residual[2]
    o0, o1, o2 = -Jw[0, 2], -Jw[1, 2], 1.0 - Jw[2, 2]
    for a in range(6):
        j0, j1, j2 = Jm[0, a], Jm[1, a], Jm[2, a]
        x = weight * (j0 * w[0] + j1 * w[1] + j2 * w[2])
        y = weight * (j0 * w[1] + j1 * w[3] + j2 * w[4])
        z = weight * (j0 * w[2] + j1 * w[4] + j2 * w[5])
        g[a] += x * r0 + y * r1 + z * r2
        by_disparity[a] += x * o0 + y * o1 + z * o2
        for c in range(a, 6):
            H[a, c] += x * Jm[0, c] + y * Jm[1, c] + z * Jm[2, c]


@kernel
def _correct(
    change: Array,
    reference: Array,
    residual: Array,
    Jw: Array,
    Jm: Array,
    w: Array,
    noise: Array,
    corrected: Array,
) -> None:
    """The point's position that its two measurements make likeliest after the motion's change."""
    r0, r1, r2 = residual[0], residual[1], residual[2]
    for k in range(6):
        r0 -= Jm[0, k] * change[k]
        r1 -= Jm[1, k] * change[k]
        r2 -= Jm[2, k] * change[k]
    x = w[0] * r0 + w[1] * r1 + w[2] * r2
    y = w[1] * r0 + w[3] * r1 + w[4] * r2
    z = w[2] * r0 + w[4] * r1 + w[5] * r2
    for k in range(3):
        corrected[k] = reference[k] + noise[k] * (Jw[0, k] * x + Jw[1, k] * y + Jw[2, k] * z)


@kernel_using(camera_motion)
def gauss_newton(
    reference: Array,
    current: Array,
    start: Array,
    supporters: NDArray[np.bool_],
    prior_mean: Array,
    prior_information: Array,
    noise: Array,
    shares: Array,
    T_base_camera: Array,
    camera: Array,
    limit: int,
) -> tuple[Array, Array, Array, Array, float, int]:
    """Motion (6,), the points' part (6, 6) of its normal equations, the motion's derivative (6,) by
    an offset of all disparities, the points' squared errors (n,), how much larger than assumed the
    pixels' variance is, and the iterations it took. Arguments as of `refine`, information being one
    over the prior's variances (6,).
    """
    n = reference.shape[0]
    motion = start.copy()
    corrected = reference.copy()
    errors, residual, information = np.zeros(n), np.empty((n, 3)), np.empty((n, 6))
    by_point, by_motion = np.empty((n, 3, 3)), np.empty((n, 3, 6))
    N, dN = np.empty((3, 4)), np.empty((6, 3, 4))
    H, g, by_disparity = np.empty((6, 6)), np.empty(6), np.empty(6)
    prior = np.diag(prior_information)
    scale, steps, settled = 1.0, 0, False
    while steps < limit and not settled:
        steps += 1
        A, b, dA, db = camera_motion(motion, T_base_camera)
        _pixel_motion(A, b, camera, N)
        for k in range(6):
            _pixel_motion(dA[k], db[k], camera, dN[k])
        _compare(
            reference, current, corrected, N, dN, noise, camera,
            errors, residual, by_point, by_motion, information,
        )  # fmt: skip
        # The gate follows the noise: too narrow it starves the estimate, too wide it lets
        # slightly wrong matches pull at it.
        spread = np.median(errors[supporters]) / MEDIAN_ERROR
        scale = max(LEAST_SCALE, spread)
        H[:], g[:], by_disparity[:] = 0.0, 0.0, 0.0
        for i in range(n):
            if errors[i] < GATE * scale:
                weight = shares[i] / (1.0 + errors[i] / (CAUCHY * scale))
                _accumulate(
                    weight, residual[i], by_point[i], by_motion[i], information[i],
                    H, g, by_disparity,
                )  # fmt: skip
        for a in range(6):
            for c in range(a):
                H[a, c] = H[c, a]
        g += prior_information * (prior_mean - motion)
        change = np.linalg.solve(H + prior, g)
        motion += change
        for i in range(n):
            if errors[i] < GATE * scale:
                _correct(
                    change, reference[i], residual[i], by_point[i], by_motion[i], information[i],
                    noise[i], corrected[i],
                )  # fmt: skip
        settled = bool(change @ g < SETTLED_2 * spread or np.abs(change).max() < SETTLED)
    by_disparity[:] = np.linalg.solve(H + prior, by_disparity)
    return motion, H, by_disparity, errors, scale, steps
