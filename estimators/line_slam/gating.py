"""How well each line that was seen fits each line of the map: eq. (13), on (r, alpha)."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from grouser.estimators.visual.single_pose import wrapped
from grouser.geometry import Array
from grouser.kernels import kernel, kernel_using


class Candidates(NamedTuple):
    """k pairs of a line seen and a line of the map that fit, each taken by itself, and how near
    the m lines seen come to the map. Pairs ascend by what was seen, then by the map."""

    seen: NDArray[np.intp]
    """(k,)"""
    lines: NDArray[np.intp]
    """(k,) of the map"""
    residuals: Array
    """(k, 2) nu, with what was seen turned over where that is nearer"""
    turned: NDArray[np.bool_]
    """(k,) whether it was"""
    noises: Array
    """(k, 2, 2) R, of what was turned over F R F"""
    scores: Array
    """(k,) d2 + ln |S|"""
    nearest: Array
    """(m,) least d2 of all pairs of a line seen; inf where it lies beside none"""


@kernel_using(wrapped)
def expected(mean: Array, at: int) -> tuple[float, float]:
    """(r, alpha) at which the robot should see the line whose states begin at `at`."""
    r, alpha = mean[at], mean[at + 1]
    r -= mean[0] * math.cos(alpha) + mean[1] * math.sin(alpha)
    return r, wrapped(alpha - mean[2])


@kernel_using(wrapped)
def innovation(r: float, alpha: float, z: Array, two_sided: bool) -> tuple[float, float, bool]:
    """What was seen, z (2,), less what is expected, and whether z was turned over for it: a line
    may be written either way about, unless its two sides are two."""
    off_r, off_alpha = z[0] - r, wrapped(z[1] - alpha)
    if two_sided or abs(off_alpha) <= math.pi / 2:
        return off_r, off_alpha, False
    return -z[0] - r, wrapped(off_alpha + math.pi), True


@kernel_using(wrapped)
def candidates(
    P: Array,
    mean: Array,
    head: int,
    rows: Array,
    beside: NDArray[np.bool_],
    z: Array,
    R: Array,
    gate: float,
    two_sided: bool,
) -> Candidates:
    """Compare m lines seen with n lines of the map.

    Args:
        P: covariance, of which the upper triangle is read; mean: the states, with `head` of them
            before the lines.
        rows: (n, 4) of the Jacobians, see `linearization.py`.
        beside: (m, n) which may be the same.
        z: (m, 2) as the robot sees them; R: (m, 2, 2) their noise.
        gate: d2 of a pair that fits, at most.
        two_sided: the two sides of a line are two different ones (of a wall), so that what was
            seen is never turned over.
    """
    m, n = beside.shape
    d2, log_det = np.full((m, n), np.inf), np.empty((m, n))
    nu, turned = np.empty((m, n, 2)), np.zeros((m, n), dtype=np.bool_)
    for j in range(n):
        if not beside[:, j].any():
            continue
        at = head + 2 * j
        s00, s01, s11 = _own_covariance(P, at, rows[j])
        r, alpha = expected(mean, at)
        for i in range(m):
            if not beside[i, j]:
                continue
            e0, e1, turned[i, j] = innovation(r, alpha, z[i], two_sided)
            # F R F, without which the filter comes to be too sure.
            r01 = -R[i, 0, 1] if turned[i, j] else R[i, 0, 1]
            a, b, d = s00 + R[i, 0, 0], s01 + r01, s11 + R[i, 1, 1]
            determinant = a * d - b * b
            d2[i, j] = (d * e0 * e0 - 2 * b * e0 * e1 + a * e1 * e1) / determinant
            log_det[i, j] = math.log(determinant)
            nu[i, j, 0], nu[i, j, 1] = e0, e1
    found: Candidates = _those_that_fit(d2, log_det, nu, turned, R, gate)
    return found


@kernel
def _own_covariance(P: Array, at: int, row: Array) -> tuple[float, float, float]:
    """H P H^T of the line whose states begin at `at`, its three different numbers."""
    h0, h1, g, c = -row[0], -row[1], row[2], row[3]
    # The upper triangle of the covariance of x, y, heading, r, alpha, times the Jacobian.
    p02, p12, p22 = P[0, 2], P[1, 2], P[2, 2]
    v0 = h0 * P[0, 0] + h1 * P[0, 1] + g * p02 + P[0, at] + c * P[0, at + 1]
    v1 = h0 * P[0, 1] + h1 * P[1, 1] + g * p12 + P[1, at] + c * P[1, at + 1]
    v2 = h0 * p02 + h1 * p12 + g * p22 + P[2, at] + c * P[2, at + 1]
    v3 = h0 * P[0, at] + h1 * P[1, at] + g * P[2, at] + P[at, at] + c * P[at, at + 1]
    v4 = h0 * P[0, at + 1] + h1 * P[1, at + 1] + g * P[2, at + 1] + P[at, at + 1]
    v4 += c * P[at + 1, at + 1]
    s00 = h0 * v0 + h1 * v1 + g * v2 + v3 + c * v4
    return s00, v4 - v2, p22 - 2 * P[2, at + 1] + P[at + 1, at + 1]


@kernel
def _those_that_fit(
    d2: Array,
    log_det: Array,
    nu: Array,
    turned: NDArray[np.bool_],
    R: Array,
    gate: float,
) -> Candidates:
    m, n = d2.shape
    k = int((d2 < gate).sum())
    out = Candidates(
        np.empty(k, dtype=np.intp),
        np.empty(k, dtype=np.intp),
        np.empty((k, 2)),
        np.empty(k, dtype=np.bool_),
        np.empty((k, 2, 2)),
        np.empty(k),
        np.full(m, np.inf),
    )
    at = 0
    for i in range(m):
        for j in range(n):
            out.nearest[i] = min(out.nearest[i], d2[i, j])
            if not d2[i, j] < gate:
                continue
            out.seen[at], out.lines[at], out.turned[at] = i, j, turned[i, j]
            out.residuals[at], out.noises[at] = nu[i, j], R[i]
            out.scores[at] = d2[i, j] + log_det[i, j]
            if turned[i, j]:
                out.noises[at, 0, 1] *= -1.0
                out.noises[at, 1, 0] *= -1.0
            at += 1
    return out


@kernel
def cross_covariances(P: Array, head: int, rows: Array, lines: NDArray[np.intp]) -> Array:
    """(k, k, 2, 2) H_a P H_b^T of the lines of the map at `lines` (k,), rows (n, 4)."""
    k = len(lines)
    out = np.empty((k, k, 2, 2))
    index = np.array([0, 1, 2, 0, 0])
    other = np.array([0, 1, 2, 0, 0])
    H, G = np.zeros((2, 5)), np.zeros((2, 5))
    for a in range(k):
        jacobian(rows[lines[a]], head + 2 * lines[a], H, index)
        for b in range(a, k):
            jacobian(rows[lines[b]], head + 2 * lines[b], G, other)
            for p in range(2):
                for q in range(2):
                    total = 0.0
                    for i in range(5):
                        for j in range(5):
                            x, y = index[i], other[j]
                            total += H[p, i] * P[min(x, y), max(x, y)] * G[q, j]
                    out[a, b, p, q] = total
                    out[b, a, q, p] = total
    return out


@kernel
def jacobian(row: Array, at: int, H: Array, index: NDArray[np.intp]) -> None:
    """Write a line's H (2, 5), and of which states it is, index (5,), the first three of the pose.

    Args:
        row: (4,) see `linearization.py`.
        at: where the line's states begin.
    """
    H[0, 0], H[0, 1], H[0, 2] = -row[0], -row[1], row[2]
    H[0, 3], H[0, 4], H[1, 2], H[1, 4] = 1.0, row[3], -1.0, 1.0
    index[3], index[4] = at, at + 1
