"""Which of the possible pairs of lines can be true together (Neira and Tardos 2001).

Two pairs may each fit well and yet not together, for one and the same motion of the robot would
have to explain both. So the largest set is sought in which every two fit jointly. A pair of it
beside which another one would do nearly as well, and would say something else, is left out: wrong
closures are worse than none.
"""

import math

import numpy as np
from numpy.typing import NDArray

from grouser.geometry import Array
from grouser.kernels import kernel

_NODES = 20_000
"""So many partial sets are looked at at most; what was best until then counts."""
_TOLD_APART = 9.21
"""Squared difference over the noise of a look, of two degrees of freedom: chi2(.99)."""


@kernel
def largest_joint_set(
    seen: NDArray[np.intp],
    residuals: Array,
    covariances: Array,
    noises: Array,
    scores: Array,
    gate: float,
    margin: float,
) -> NDArray[np.bool_]:
    """(k,) which of k pairs to believe: of the largest set, of as many the one with the least
    score, those that nothing rivals.

    Args:
        seen: (k,) which line was seen; each is in at most one pair. Ascending.
        residuals: (k, 2); covariances: (k, k, 2, 2) H P H^T between pairs; noises: (k, 2, 2) R.
        scores: (k,) d2 + ln |S| of each pair alone.
        gate: what two pairs' joint d2, of four degrees of freedom, must not exceed.
        margin: by which a rival's score must exceed a pair's.
    """
    if len(seen) == 0:
        return np.zeros(0, dtype=np.bool_)
    compatible = _compatible(seen, residuals, covariances, noises, gate)
    chosen = _search(seen, compatible, scores)
    left: NDArray[np.bool_]
    left = _unrivalled(seen, residuals, noises, compatible, scores, chosen, margin)
    return left


@kernel
def _compatible(
    seen: NDArray[np.intp], residuals: Array, covariances: Array, noises: Array, gate: float
) -> NDArray[np.bool_]:
    k = len(seen)
    out = np.zeros((k, k), dtype=np.bool_)
    S, nu = np.empty((4, 4)), np.empty(4)
    for a in range(k):
        for b in range(a + 1, k):
            if seen[a] == seen[b]:
                continue
            for p in range(2):
                nu[p], nu[2 + p] = residuals[a, p], residuals[b, p]
                for q in range(2):
                    S[p, q] = covariances[a, a, p, q] + noises[a, p, q]
                    S[2 + p, 2 + q] = covariances[b, b, p, q] + noises[b, p, q]
                    S[2 + p, q] = covariances[a, b, q, p]
            out[a, b] = out[b, a] = _squared(nu, S) <= gate
    return out


@kernel
def _squared(nu: Array, S: Array) -> float:
    """nu^T S^-1 nu by the Cholesky factor of S, whose lower triangle and nu are overwritten; NaN
    where S is not positive definite. For so few numbers LAPACK takes ten times as long."""
    total = 0.0
    for i in range(len(nu)):
        for j in range(i + 1):
            for k in range(j):
                S[i, j] -= S[i, k] * S[j, k]
            if i > j:
                S[i, j] /= S[j, j]
        S[i, i] = math.sqrt(S[i, i])
        for k in range(i):
            nu[i] -= S[i, k] * nu[k]
        nu[i] /= S[i, i]
        total += nu[i] * nu[i]
    return total


@kernel
def _search(
    seen: NDArray[np.intp], compatible: NDArray[np.bool_], scores: Array
) -> NDArray[np.bool_]:
    """Depth first over the lines seen, of each one of its pairs or none; it cuts what can no more
    become the largest."""
    k = len(seen)
    first = np.empty(k + 1, dtype=np.intp)  # of the pairs of each line seen
    lines = 0
    for a in range(k):
        if a == 0 or seen[a] != seen[a - 1]:
            first[lines] = a
            lines += 1
    first[lines] = k
    chosen = np.full(lines, -1)  # the pair of each line, or -1
    tried = np.empty(lines, dtype=np.intp)  # the next pair to try
    counts, sums = np.zeros(lines + 1, dtype=np.intp), np.zeros(lines + 1)
    best = np.zeros(k, dtype=np.bool_)
    best_count, best_sum, nodes = 0, np.inf, 0
    at = 0
    tried[0] = first[0]
    while at >= 0:
        if at == lines:
            count, total = counts[at], sums[at]
            if count > best_count or (count == best_count and total < best_sum):
                best_count, best_sum = count, total
                best[:] = False
                for line in range(lines):
                    if chosen[line] >= 0:
                        best[chosen[line]] = True
            at -= 1
            continue
        nodes += 1
        if nodes > _NODES:
            break
        moved = False
        if counts[at] + lines - at >= best_count:
            while tried[at] < first[at + 1]:
                a = tried[at]
                tried[at] += 1
                fits = True
                for line in range(at):
                    if chosen[line] >= 0 and not compatible[a, chosen[line]]:
                        fits = False
                        break
                if fits:
                    chosen[at] = a
                    counts[at + 1], sums[at + 1] = counts[at] + 1, sums[at] + scores[a]
                    moved = True
                    break
            if not moved and tried[at] == first[at + 1]:
                tried[at] += 1  # last of all, none
                chosen[at] = -1
                counts[at + 1], sums[at + 1] = counts[at], sums[at]
                moved = True
        if moved:
            at += 1
            if at < lines:
                tried[at] = first[at]
        else:
            at -= 1
    return best


@kernel
def _unrivalled(
    seen: NDArray[np.intp],
    residuals: Array,
    noises: Array,
    compatible: NDArray[np.bool_],
    scores: Array,
    chosen: NDArray[np.bool_],
    margin: float,
) -> NDArray[np.bool_]:
    """The chosen pairs, less those for which another line of the map would do nearly as well beside
    all other chosen ones. Lines of the map that noise could not tell apart are no rivals."""
    out = chosen.copy()
    for a in range(len(seen)):
        if not chosen[a]:
            continue
        for b in range(len(seen)):
            if b == a or seen[b] != seen[a] or scores[b] - scores[a] > margin:
                continue
            if _squared(residuals[b] - residuals[a], noises[a].copy()) < _TOLD_APART:
                continue
            beside = True
            for other in range(len(seen)):
                if chosen[other] and other != a and not compatible[b, other]:
                    beside = False
                    break
            if beside:
                out[a] = False
                break
    return out
