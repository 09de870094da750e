"""RANSAC on the prior of the filter: a hypothesis is an update with one match, or with two.

Civera et al., algorithm 1. The prediction already knows the motion nearly; the few numbers that it
does not know are what one match corrects, in the state's mean alone, and the others vote.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from grouser.estimators.monocular.camera import Innovation, Matches
from grouser.estimators.monocular.state import HEAD, MOTION, SlamState
from grouser.estimators.visual.motion import camera_motion, measure
from grouser.geometry import Array
from grouser.kernels import kernel, kernel_using

SUCCESS = 0.99
"""Probability that one hypothesis at least is made of inliers."""
MOST = 500
"""Hypotheses at most: safe against 90 % of outliers with two matches a hypothesis."""

_MOTION, _HEAD = MOTION.start, HEAD


@dataclass(frozen=True, slots=True)
class Consensus:
    """The hypothesis that most agree on."""

    inliers: NDArray[np.bool_]
    """(m,) low-innovation inliers: matches that lie within the threshold of it"""
    trials: int


def draw_samples(matches: int, size: int, rng: np.random.Generator) -> NDArray[np.int64]:
    """(k, size) matches of every hypothesis, none with the same set twice.

    Of one match there are as many hypotheses as matches; of two, MOST at most.
    """
    if matches < size:
        return np.zeros((0, size), dtype=np.int64)
    if size == 1:
        return rng.permutation(matches)[:, None]
    first, second = np.triu_indices(matches, 1)
    order = rng.permutation(len(first))[:MOST]
    return np.column_stack([first[order], second[order]])


def ransac(
    state: SlamState,
    matches: Matches,
    innovation: Innovation,
    *,
    samples: NDArray[np.int64],
    threshold_px: float,
    T_base_camera: Array,
    intrinsics: Array,
) -> Consensus:
    """The best of the hypotheses that the samples (k, 1 or 2) make, as far as they are needed.

    Args:
        state: predicted.
        innovation: of all matches.
        threshold_px: how far an inlier's residual may be, after the hypothesis.
    """
    if len(samples) == 0:
        return Consensus(np.zeros(len(matches.seen), dtype=bool), 0)
    inliers, trials = _ransac(
        state.points[matches.seen],
        state.motion,
        matches.places,
        innovation.residual,
        innovation.covariance,
        innovation.cross[:, _MOTION:_HEAD],
        _cross_of_points(innovation.cross, matches.seen),
        samples,
        threshold_px,
        T_base_camera,
        intrinsics,
    )
    return Consensus(inliers, trials)


def _cross_of_points(cross: Array, seen: NDArray[np.int64]) -> Array:
    """(2 m, m, 3) of H P: the columns of the points that were seen."""
    return np.ascontiguousarray(cross[:, _HEAD:].reshape(len(cross), -1, 3)[:, seen])


@kernel
def trials_needed(inlier_share: float, size: int) -> float:
    """Hypotheses of `size` matches until one is free of outliers with probability SUCCESS."""
    good = inlier_share**size
    if good <= 0.0:
        return np.inf
    return math.log(1 - SUCCESS) / math.log(1 - good) if good < 1.0 else 1.0


@kernel_using(measure, camera_motion)
def _ransac(
    points: Array,
    motion: Array,
    measured: Array,
    residual: Array,
    S: Array,
    cross_motion: Array,
    cross_points: Array,
    samples: NDArray[np.int64],
    threshold: float,
    T_base_camera: Array,
    camera: Array,
) -> tuple[NDArray[np.bool_], int]:
    m, size = points.shape[0], samples.shape[1]
    rows = np.empty(2 * size, np.int64)
    own, right = np.empty((2 * size, 2 * size)), np.empty(2 * size)
    moved, w = np.empty(6), np.empty(3)
    p, unused_w, unused_m = np.empty(3), np.empty((3, 3)), np.empty((3, 6))
    inliers, best = np.zeros(m, np.bool_), np.zeros(m, np.bool_)
    least, trials, needed = np.inf, 0, np.inf
    while trials < samples.shape[0] and trials < needed:
        for s in range(size):
            rows[2 * s], rows[2 * s + 1] = 2 * samples[trials, s], 2 * samples[trials, s] + 1
        for a in range(2 * size):
            right[a] = residual[rows[a]]
            for b in range(2 * size):
                own[a, b] = S[rows[a], rows[b]]
        weights = np.linalg.solve(own, right)
        moved[:] = motion
        for a in range(2 * size):
            moved += weights[a] * cross_motion[rows[a]]
        A, b_, dA, db = camera_motion(moved, T_base_camera)
        # Civera et al. count the inliers; their squared errors, cut off, also tell how well they
        # agree (MSAC), which counts where many hypotheses are good.
        cost, agreeing = 0.0, 0
        for j in range(m):
            w[:] = points[j]
            for a in range(2 * size):
                for c in range(3):
                    w[c] += weights[a] * cross_points[rows[a], j, c]
            error = np.inf
            if measure(w, A, b_, dA, db, camera, p, unused_w, unused_m):
                error = (measured[j, 0] - p[0]) ** 2 + (measured[j, 1] - p[1]) ** 2
            inliers[j] = error < threshold**2
            agreeing += inliers[j]
            cost += min(error, threshold**2)
        if cost < least:
            least = cost
            best[:] = inliers
            needed = trials_needed(agreeing / m, size)
        trials += 1
    return best, trials
