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
    floor = _NEGLIGIBLE * np.diag(np.array([A[0, 0] + A[1, 1], A[0, 0] + A[1, 1], A[2, 2]]))
    C = np.linalg.cholesky(S + floor + _NOTHING * np.eye(3))
    to = np.linalg.inv(C)
    values, vectors = np.linalg.eigh(to @ A @ to.T)
    share = np.where(values > _ABOVE_NOISE, 1 - 1 / np.maximum(values, 1.0), 0.0)
    F: Array = (C @ vectors * share) @ (vectors.T @ to)
    return F


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
    for _ in range(steps):
        pair(surface, reference, pose, radius, cauchy, same_side, pairs)
        A, S, b = normal_equations(pairs, _variances(pairs, cauchy, least))
        F = believed(A, S)
        off = pose - guess
        off[2] = wrapped(off[2])
        step = np.linalg.solve(F @ A + information, F @ b - information @ off)
        pose += step
        settled = radius <= last_radius
        radius = max(last_radius, shrinking * radius)
        if settled and np.abs(step).max() < _STILL:
            break
    pose[2] = wrapped(pose[2])
    pair(surface, reference, pose, radius, cauchy, same_side, pairs)
    variances = _variances(pairs, cauchy, least)
    A, S, _ = normal_equations(pairs, variances)
    F = independent_share(pairs, variances) * believed(A, S)
    by_scan = np.zeros((len(reference.poses), 3, 3))
    information_by_scan(pairs, variances, by_scan)
    for k in range(len(by_scan)):
        by_scan[k] = F @ by_scan[k]
    inliers = (pairs.weights >= 0.5).sum()
    directions = np.ascontiguousarray((A - S)[:2, :2])
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
