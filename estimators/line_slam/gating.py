"""How well each line that was seen fits each line of the map: eq. (13), on (r, alpha)."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from grouser.estimators.line_slam.lines import lines_in_frame
from grouser.estimators.line_slam.measurements import LineMeasurements
from grouser.estimators.line_slam.state import LineState
from grouser.geometry import Array
from grouser.kernels import kernel


@dataclass(frozen=True, slots=True)
class Fit:
    """m lines seen beside n lines of the map, each taken by itself."""

    d2: Array
    """(m, n) nu^T S^-1 nu"""
    log_det: Array
    """(m, n) ln |S|"""
    residuals: Array
    """(m, n, 2) nu, with what was seen turned over where that is nearer"""
    turned: NDArray[np.bool_]
    """(m, n) whether it was"""


def fit(state: LineState, rows: Array, seen: LineMeasurements, *, two_sided: bool) -> Fit:
    """Compare them all.

    Args:
        rows: (n, 4) of the Jacobians, see `linearization.py`.
        two_sided: the two sides of a line are two different ones (of a wall), so that what was
            seen is never turned over.
    """
    predicted = lines_in_frame(state.lines, state.pose)
    return Fit(
        *_fit(state.buffer, state.head, rows, predicted, seen.lines, seen.covariances, two_sided)
    )


@kernel
def _fit(
    P: Array, head: int, rows: Array, predicted: Array, z: Array, R: Array, two_sided: bool
) -> tuple[Array, Array, Array, NDArray[np.bool_]]:
    m, n = len(z), len(predicted)
    d2, log_det = np.empty((m, n)), np.empty((m, n))
    residuals, turned = np.empty((m, n, 2)), np.zeros((m, n), dtype=np.bool_)
    for j in range(n):
        r = head + 2 * j
        h0, h1, g, c = -rows[j, 0], -rows[j, 1], rows[j, 2], rows[j, 3]
        # The upper triangle of the covariance of x, y, heading, r, alpha, times the Jacobian.
        p02, p12, p22 = P[0, 2], P[1, 2], P[2, 2]
        v0 = h0 * P[0, 0] + h1 * P[0, 1] + g * p02 + P[0, r] + c * P[0, r + 1]
        v1 = h0 * P[0, 1] + h1 * P[1, 1] + g * p12 + P[1, r] + c * P[1, r + 1]
        v2 = h0 * p02 + h1 * p12 + g * p22 + P[2, r] + c * P[2, r + 1]
        v3 = h0 * P[0, r] + h1 * P[1, r] + g * P[2, r] + P[r, r] + c * P[r, r + 1]
        v4 = h0 * P[0, r + 1] + h1 * P[1, r + 1] + g * P[2, r + 1] + P[r, r + 1]
        v4 += c * P[r + 1, r + 1]
        s00 = h0 * v0 + h1 * v1 + g * v2 + v3 + c * v4
        s01 = v4 - v2
        s11 = p22 - 2 * P[2, r + 1] + P[r + 1, r + 1]
        for i in range(m):
            e0, e1 = z[i, 0] - predicted[j, 0], _wrapped(z[i, 1] - predicted[j, 1])
            r01 = R[i, 0, 1]
            if not two_sided and abs(e1) > math.pi / 2:
                e0, e1 = -z[i, 0] - predicted[j, 0], _wrapped(e1 + math.pi)
                r01 = -r01  # F R F, without which the filter comes to be too sure
                turned[i, j] = True
            a, b, d = s00 + R[i, 0, 0], s01 + r01, s11 + R[i, 1, 1]
            determinant = a * d - b * b
            d2[i, j] = (d * e0 * e0 - 2 * b * e0 * e1 + a * e1 * e1) / determinant
            log_det[i, j] = math.log(determinant)
            residuals[i, j, 0], residuals[i, j, 1] = e0, e1
    return d2, log_det, residuals, turned


@kernel
def _wrapped(angle: float) -> float:
    return angle - 2 * math.pi * math.ceil((angle - math.pi) / (2 * math.pi))


@kernel
def cross_covariances(P: Array, head: int, rows: Array, lines: NDArray[np.intp]) -> Array:
    """(k, k, 2, 2) H_a P H_b^T of the lines of the map at `lines` (k,), rows (n, 4)."""
    k = len(lines)
    out = np.empty((k, k, 2, 2))
    index = np.array([0, 1, 2, 0, 0])
    other = np.array([0, 1, 2, 0, 0])
    H, G = np.zeros((2, 5)), np.zeros((2, 5))
    for a in range(k):
        _fill(H, index, head, rows, lines[a])
        for b in range(a, k):
            _fill(G, other, head, rows, lines[b])
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
def _fill(H: Array, index: NDArray[np.intp], head: int, rows: Array, line: int) -> None:
    H[0, 0], H[0, 1], H[0, 2] = -rows[line, 0], -rows[line, 1], rows[line, 2]
    H[0, 3], H[0, 4], H[1, 2], H[1, 4] = 1.0, rows[line, 3], -1.0, 1.0
    index[3], index[4] = head + 2 * line, head + 2 * line + 1
