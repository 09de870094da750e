"""Steps of a filter of many lines that touch few of its states, on a covariance in one buffer.

Of a covariance P only the upper triangle is kept: P[i, j] for i <= j. A line that is seen touches
the pose and itself, so that P H^T is a combination of five columns, and its correction of rank
two: P - W^T W. The corrections of one scan are gathered in W, whose rows `correct` adds and takes
into account, and `absorb` subtracts them in one pass over P, which is what costs.
"""

import math

import numpy as np
from numpy.typing import NDArray

from grouser.geometry import Array
from grouser.kernels import kernel


@kernel
def propagate(P: Array, n: int, F: Array, Q: Array) -> None:
    """In place: F P F^T + Q of the first h states, F and Q (h, h); P has n states in all."""
    h = F.shape[0]
    head = np.empty((h, h))
    for i in range(h):
        for j in range(h):
            head[i, j] = P[min(i, j), max(i, j)]
    right = P[:h, h:n].copy()
    for i in range(h):
        for c in range(n - h):
            P[i, h + c] = 0.0
        for k in range(h):
            if F[i, k] != 0.0:
                for c in range(n - h):
                    P[i, h + c] += F[i, k] * right[k, c]
    moved = F @ head @ F.T
    for i in range(h):
        for j in range(i, h):
            P[i, j] = 0.5 * (moved[i, j] + moved[j, i] + Q[i, j] + Q[j, i])


@kernel
def block(P: Array, indices: NDArray[np.intp]) -> Array:
    """(k, k) covariance of the states at `indices` (k,)."""
    k = len(indices)
    out = np.empty((k, k))
    for a in range(k):
        for b in range(k):
            i, j = indices[a], indices[b]
            out[a, b] = P[min(i, j), max(i, j)]
    return out


@kernel
def correct(
    P: Array,
    n: int,
    W: Array,
    used: int,
    indices: NDArray[np.intp],
    H: Array,
    R: Array,
    residual: Array,
    gate: float,
) -> tuple[Array, float]:
    """A correction by two numbers that depend on few states: (change of the states (n,), d2).

    Args:
        P: before the corrections that W has so far, its rows below `used`.
        W: (rows, capacity); rows `used` and `used + 1` are written.
        indices: (k,) which states; H: (2, k) the derivative by them; R: (2, 2).
        gate: if d2, the squared residual over its covariance, exceeds it, nothing is written and
            nothing changes.
    """
    k = len(indices)
    S00, S01, S11 = R[0, 0], R[0, 1], R[1, 1]
    for a in range(k):
        for b in range(k):
            i, j = indices[a], indices[b]
            covariance = P[min(i, j), max(i, j)]
            for row in range(used):
                covariance -= W[row, i] * W[row, j]
            S00 += H[0, a] * covariance * H[0, b]
            S01 += H[0, a] * covariance * H[1, b]
            S11 += H[1, a] * covariance * H[1, b]
    # The Cholesky factor of S whitens the residual and P H^T.
    L00 = math.sqrt(S00)
    L10 = S01 / L00
    L11 = math.sqrt(S11 - L10 * L10)
    e0 = residual[0] / L00
    e1 = (residual[1] - L10 * e0) / L11
    d2 = e0 * e0 + e1 * e1
    if not d2 <= gate:
        return np.zeros(n), d2
    w0, w1 = W[used], W[used + 1]
    w0[:n] = 0.0
    w1[:n] = 0.0
    for a in range(k):
        j, h0, h1 = indices[a], H[0, a], H[1, a]
        for i in range(j):
            w0[i] += h0 * P[i, j]
            w1[i] += h1 * P[i, j]
        for i in range(j, n):
            w0[i] += h0 * P[j, i]
            w1[i] += h1 * P[j, i]
        for row in range(used):
            before = W[row]
            g0, g1 = h0 * before[j], h1 * before[j]
            for i in range(n):
                w0[i] -= g0 * before[i]
                w1[i] -= g1 * before[i]
    change = np.empty(n)
    for i in range(n):
        w0[i] /= L00
        w1[i] = (w1[i] - L10 * w0[i]) / L11
        change[i] = w0[i] * e0 + w1[i] * e1
    return change, d2


@kernel
def absorb(P: Array, n: int, W: Array, used: int) -> None:
    """In place: P - W^T W, of the even number `used` of rows of W, four at a time."""
    fours = used // 4 * 4
    for i in range(n):
        # Views that begin at zero: an index that may be negative would keep the loops from vectors.
        row = P[i, i:n]
        for k in range(0, fours, 4):
            w0, w1, w2, w3 = W[k, i:n], W[k + 1, i:n], W[k + 2, i:n], W[k + 3, i:n]
            a0, a1, a2, a3 = w0[0], w1[0], w2[0], w3[0]
            for c in range(row.size):
                row[c] -= (a0 * w0[c] + a1 * w1[c]) + (a2 * w2[c] + a3 * w3[c])
        if fours < used:
            w0, w1 = W[fours, i:n], W[fours + 1, i:n]
            a0, a1 = w0[0], w1[0]
            for c in range(row.size):
                row[c] -= a0 * w0[c] + a1 * w1[c]


@kernel
def augment(P: Array, n: int, indices: NDArray[np.intp], G: Array, noise: Array) -> None:
    """In place: two more states, with derivative G (2, k) by those at `indices`, and a noise."""
    column = np.zeros((n, 2))
    for a in range(len(indices)):
        j = indices[a]
        for i in range(n):
            covariance = P[min(i, j), max(i, j)]
            column[i, 0] += covariance * G[0, a]
            column[i, 1] += covariance * G[1, a]
    P[:n, n : n + 2] = column
    own = noise.copy()
    for a in range(len(indices)):
        for r in range(2):
            for c in range(2):
                own[r, c] += G[r, a] * column[indices[a], c]
    P[n, n], P[n + 1, n + 1] = own[0, 0], own[1, 1]
    P[n, n + 1] = 0.5 * (own[0, 1] + own[1, 0])


@kernel
def remove(P: Array, n: int, at: int) -> None:
    """In place: forget states `at` and `at + 1` of n; those behind move up."""
    for i in range(at):
        for c in range(at, n - 2):
            P[i, c] = P[i, c + 2]
    for i in range(at, n - 2):
        for c in range(i, n - 2):
            P[i, c] = P[i + 2, c + 2]


@kernel
def shear(P: Array, n: int, h: int, U: Array) -> None:
    """In place: (I + U E) P (I + U E)^T, where E picks the first h states and U is (n, h).

    With A = P E^T + U (E P E^T) / 2 that is P + A U^T + U A^T.
    """
    A = np.empty((h, n))
    for k in range(h):
        for i in range(n):
            A[k, i] = P[min(i, k), max(i, k)]
    head = A[:, :h].copy()
    for k in range(h):
        for j in range(h):
            for i in range(n):
                A[k, i] += 0.5 * U[i, j] * head[j, k]
    Ut = U.T.copy()
    for i in range(n):
        row = P[i]
        for k in range(h):
            a, u = A[k, i], Ut[k, i]
            for c in range(i, n):
                row[c] += a * Ut[k, c] + u * A[k, c]
