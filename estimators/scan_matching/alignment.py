"""Point-to-line alignment: Gauss-Newton on the distances of points to the surface nearest to them,
with Cauchy's weights (Censi, "An ICP variant using a point-to-line metric", ICRA 2008)."""

import math
from dataclasses import dataclass

import numpy as np

from grouser.checks import require_not_negative, require_positive, require_whole
from grouser.estimators.scan_matching.pairs import (
    Pairs,
    independent_share,
    information_by_scan,
    no_pairs,
    normal_equations,
    pair,
    variance,
)
from grouser.estimators.scan_matching.reference import REACH, Reference
from grouser.estimators.scan_matching.surface import Surface
from grouser.estimators.visual.single_pose import wrapped
from grouser.geometry import Array
from grouser.kernels import kernel, kernel_using


@dataclass(frozen=True, slots=True)
class AlignmentOptions:
    """Which points belong together, and which of them are believed."""

    first_radius: float = REACH
    """From a point to what it is taken for, at most, in the first step, m;"""
    last_radius: float = 0.15
    """the same in the end, m."""
    shrinking: float = 0.8
    """The radius of a step over that of the one before."""
    cauchy: float = 0.05
    """Distance at which a point counts half, m, at least: where surfaces are rough, it is that at
    which Cauchy's estimate loses 5 % of what is told."""
    same_side: float = 0.7
    """Cosine between normals of the same surface, at least."""
    sigma_off_lines: float = 0.05
    """Of a coordinate of a point that is on no line, at least, m: another scan meets clutter
    elsewhere."""
    steps: int = 30
    """Of Gauss-Newton, at most."""

    def __post_init__(self) -> None:
        require_positive(self, "first_radius", "last_radius", "shrinking", "cauchy")
        require_positive(self, "sigma_off_lines")
        require_not_negative(self, "same_side")
        require_whole(self, "steps")
        if self.first_radius > REACH:
            raise ValueError(
                f"AlignmentOptions.first_radius must be at most {REACH} m, got {self.first_radius}"
            )


@dataclass(frozen=True, slots=True)
class Alignment:
    """Where Gauss-Newton ended, and what the distances tell of it."""

    pose: Array
    """(3,) of the scan in the frame of the reference"""
    by_scan: Array
    """(k, 3, 3) information on the pose from each scan of the reference, as if its pose were known;
    without what noise in the normals only seems to tell, and as if the reference had no noise.
    Their sum is a symmetric matrix."""
    inliers: int
    """Points that count at least half"""
    directions: Array
    """(2, 2) information on the position if the heading is known, over the inliers"""
    sigma: float
    """Of a distance from a line, m"""


def align(
    surface: Surface,
    reference: Reference,
    start: Array,
    guess: Array,
    information: Array,
    options: AlignmentOptions,
) -> Alignment:
    """Lay a scan over the reference, beginning at the pose `start` (3,).

    Args:
        guess: (3,) that the prior expects, with the inverse covariance `information` (3, 3).
    """
    return Alignment(
        *_aligned(
            surface,
            reference,
            start,
            guess,
            information,
            options.first_radius,
            options.last_radius,
            options.shrinking,
            max(options.cauchy, _EFFICIENT * surface.sigma),
            options.same_side,
            np.array([options.sigma_off_lines, surface.sigma]) ** 2,
            options.steps,
        )
    )


@kernel
def believed(A: Array, S: Array) -> Array:
    """(3, 3) F, so that F A is what of the information A noise in the normals did not make.

    A normal that is off by noise seems to hold a scan along its wall. S is the information that
    this makes on average: directions in which A is not well above S tell nothing, and from the
    others S is taken off. F A is symmetric and not negative.
    """
    C, to = S.copy(), np.zeros((3, 3))
    for i in range(3):
        C[i, i] += _NOTHING + _NEGLIGIBLE * (A[2, 2] if i == 2 else A[0, 0] + A[1, 1])
    _factorise(C, to)
    values, vectors = np.linalg.eigh(_times(_times(to, A), to.T))
    told = _times(C, vectors)
    for j in range(3):
        share = 1 - 1 / values[j] if values[j] > _ABOVE_NOISE else 0.0
        for i in range(3):
            told[i, j] *= share
    F: Array = _times(told, _times(vectors.T, to))
    return F


@kernel
def _factorise(C: Array, to: Array) -> None:
    """C (3, 3) becomes its Cholesky factor, and `to`, which is zero, the inverse of that."""
    for i in range(3):
        for j in range(i + 1):
            for k in range(j):
                C[i, j] -= C[i, k] * C[j, k]
            C[i, j] = math.sqrt(C[i, i]) if i == j else C[i, j] / C[j, j]
        for j in range(i + 1, 3):
            C[i, j] = 0.0
        to[i, i] = 1 / C[i, i]
        for j in range(i):
            for k in range(j, i):
                to[i, j] -= C[i, k] * to[k, j] / C[i, i]


@kernel
def _times(A: Array, B: Array) -> Array:
    """A B, (3, 3): for so few numbers a library takes longer to be called."""
    out = np.zeros((3, 3))
    for i in range(3):
        for j in range(3):
            for k in range(3):
                out[i, j] += A[i, k] * B[k, j]
    return out


@kernel_using(pair, normal_equations, variance, information_by_scan, independent_share, wrapped)
def _aligned(
    surface: Surface,
    reference: Reference,
    start: Array,
    guess: Array,
    information: Array,
    radius: float,
    last_radius: float,
    shrinking: float,
    cauchy: float,
    same_side: float,
    least: Array,
    steps: int,
) -> tuple[Array, Array, int, Array, float]:
    """What an `Alignment` says; `least` are the variances (2,), at least, of `_variances`."""
    pose, pairs = start.copy(), no_pairs(len(surface.points))
    off, b = np.empty(3), np.empty(3)
    for _ in range(steps):
        pair(surface, reference, pose, radius, cauchy, same_side, pairs)
        A, S, gradient = normal_equations(pairs, _variances(pairs, cauchy, least))
        F = believed(A, S)
        A = _times(F, A)
        off[0], off[1], off[2] = pose[0] - guess[0], pose[1] - guess[1], wrapped(pose[2] - guess[2])
        for i in range(3):
            b[i] = 0.0
            for j in range(3):
                A[i, j] += information[i, j]
                b[i] += F[i, j] * gradient[j] - information[i, j] * off[j]
        step = np.linalg.solve(A, b)
        pose += step
        settled = radius <= last_radius
        radius = max(last_radius, shrinking * radius)
        if settled and max(abs(step[0]), abs(step[1]), abs(step[2])) < _STILL:
            break
    pose[2] = wrapped(pose[2])
    pair(surface, reference, pose, radius, cauchy, same_side, pairs)
    variances = _variances(pairs, cauchy, least)
    A, S, _ = normal_equations(pairs, variances)
    F, share = believed(A, S), independent_share(pairs, variances)
    by_scan = np.zeros((len(reference.poses), 3, 3))
    information_by_scan(pairs, variances, by_scan)
    for k in range(len(by_scan)):
        by_scan[k] = _times(F, by_scan[k]) * share
    inliers = 0
    for k in range(len(pairs.weights)):
        inliers += pairs.weights[k] >= 0.5
    directions = np.empty((2, 2))
    for i in range(2):
        for j in range(2):
            directions[i, j] = A[i, j] - S[i, j]
    return pose, by_scan, inliers, directions, math.sqrt(variances[1])


@kernel_using(variance)
def _variances(pairs: Pairs, cauchy: float, least: Array) -> Array:
    """(2,) of a coordinate of a point off lines, and of a distance from a line, m^2."""
    off_lines = variance(pairs, False, cauchy, least[0])
    return np.array([off_lines, variance(pairs, True, cauchy, least[1])])


_EFFICIENT = 2.385
"""Of a distance's sigma (Holland and Welsch, "Robust regression using iteratively reweighted
least-squares", 1977)"""
_STILL = 1e-9
"""m, rad: a step that changes nothing any more"""
_ABOVE_NOISE = 3.0
"""Times S that the information in a direction is at least"""
_NEGLIGIBLE, _NOTHING = 1e-9, 1e-12
