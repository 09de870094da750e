"""Point-to-line alignment: Gauss-Newton on the distances of points to the surface nearest to them,
with Cauchy's weights (Censi, "An ICP variant using a point-to-line metric", ICRA 2008)."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from grouser.checks import require_not_negative, require_positive, require_whole
from grouser.estimators.scan_matching.nearest_field import nearest_to
from grouser.estimators.scan_matching.reference import REACH, Reference
from grouser.estimators.scan_matching.surface import Surface
from grouser.geometry import Array, wrap
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
    """Distance at which a point counts half, m."""
    same_side: float = 0.7
    """Cosine between normals of the same surface, at least."""
    steps: int = 30
    """Of Gauss-Newton, at most."""

    def __post_init__(self) -> None:
        require_positive(self, "first_radius", "last_radius", "shrinking", "cauchy")
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
    without what noise in the normals only seems to tell. Their sum is a symmetric matrix."""
    inliers: int
    """Points that count at least half"""
    directions: Array
    """(2, 2) sum of the inliers' n n' less what their noise makes of it: which way they hold the
    scan"""
    sigma: float
    """of a distance, m"""
    correlation: float
    """of the distances of neighbours, between 0 and 0.9"""


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
    pose, radius = start.copy(), options.first_radius
    variance = options.cauchy**2
    # Points that noise brought together are nearest; their distances alone would seem too small.
    least = surface.sigma**2 + reference.surface.sigma**2
    pairs = np.empty((len(surface.points), _COLUMNS))
    owners = np.empty(len(surface.points), dtype=np.int32)
    for _ in range(options.steps):
        _pair(surface, reference, pose, radius, options.cauchy, options.same_side, pairs, owners)
        A, S, b, variance = _normal_equations(pairs, options.cauchy, least)
        F = believed(A, S)
        off = pose - guess
        off[2] = wrap(off[2])
        step = np.linalg.solve(F @ A + information, F @ b - information @ off)
        pose = pose + step
        settled = radius <= options.last_radius
        radius = max(options.last_radius, options.shrinking * radius)
        if settled and float(np.abs(step).max()) < _STILL:
            break
    pose[2] = wrap(pose[2])
    _pair(surface, reference, pose, radius, options.cauchy, options.same_side, pairs, owners)
    A, S, _, variance = _normal_equations(pairs, options.cauchy, least)
    correlation, inliers, directions = _neighbours(pairs)
    shared = (1 - correlation) / (1 + correlation)
    by_scan = np.zeros((len(reference.poses), 3, 3))
    _share(pairs, owners, by_scan)
    by_scan = (shared / variance) * (believed(A, S) @ by_scan)
    return Alignment(pose, by_scan, inliers, directions, float(np.sqrt(variance)), correlation)


def believed(A: Array, S: Array) -> Array:
    """(3, 3) F, so that F A is what of the information A noise in the normals did not make.

    A normal that is off by noise seems to hold a scan along its wall. S is the information that
    this makes on average: directions in which A is not well above S tell nothing, and from the
    others S is taken off. F A is symmetric and not negative.
    """
    floor = _NEGLIGIBLE * np.diag([A[0, 0] + A[1, 1], A[0, 0] + A[1, 1], A[2, 2]])
    C = np.linalg.cholesky(S + floor + _NOTHING * np.eye(3))
    to = np.linalg.inv(C)
    values, vectors = np.linalg.eigh(to @ A @ to.T)
    share = np.where(values > _ABOVE_NOISE, 1 - 1 / np.maximum(values, 1), 0.0)
    U = C @ vectors
    return np.asarray((U * share) @ (vectors.T @ to))


_COLUMNS = 8
"""Of pairs: weight (0 where there is none), distance, its derivative by the pose, then by a motion
along the wall times the normal's sigma."""
_STILL = 1e-9
"""m, rad: a step that changes nothing any more"""
_ABOVE_NOISE = 3.0
"""Times S that the information in a direction is at least"""
_NEGLIGIBLE, _NOTHING = 1e-9, 1e-12


@kernel_using(nearest_to)
def _pair(
    surface: Surface,
    reference: Reference,
    pose: Array,
    radius: float,
    cauchy: float,
    same_side: float,
    pairs: Array,
    owners: NDArray[np.int32],
) -> None:
    points, normals, sigmas, _ = surface
    q, n, n_sigmas, _ = reference.surface
    c, s = np.cos(pose[2]), np.sin(pose[2])
    for k in range(len(points)):
        pairs[k, 0] = 0.0
        owners[k] = -1
        if not np.isfinite(sigmas[k]):
            continue
        # The lever from the scan's origin to the point, in the reference's frame.
        lx, ly = c * points[k, 0] - s * points[k, 1], s * points[k, 0] + c * points[k, 1]
        x, y = pose[0] + lx, pose[1] + ly
        i = nearest_to(reference.field, x, y)
        if i < 0 or not np.isfinite(n_sigmas[i]):
            continue
        dx, dy = x - q[i, 0], y - q[i, 1]
        if dx * dx + dy * dy > radius * radius:
            continue
        nx, ny = n[i, 0], n[i, 1]
        mx, my = c * normals[k, 0] - s * normals[k, 1], s * normals[k, 0] + c * normals[k, 1]
        if nx * mx + ny * my < same_side:
            continue
        distance = nx * dx + ny * dy
        owners[k] = reference.scans[i]
        pairs[k, 0] = 1 / (1 + (distance / cauchy) ** 2)
        pairs[k, 1] = distance
        pairs[k, 2], pairs[k, 3], pairs[k, 4] = nx, ny, ny * lx - nx * ly
        pairs[k, 5] = n_sigmas[i] * -ny
        pairs[k, 6] = n_sigmas[i] * nx
        pairs[k, 7] = n_sigmas[i] * (nx * lx + ny * ly)


@kernel
def _normal_equations(
    pairs: Array, cauchy: float, least: float
) -> tuple[Array, Array, Array, float]:
    """(A, S, b, variance) of a distance, A, S and b in units of it; see `believed` for S.

    The variance is that of Huber's M-estimators, by psi(r) = w r and its derivative: with it, A is
    the information on the pose although weights shrink what is far off.
    """
    A, S, b = np.zeros((3, 3)), np.zeros((3, 3)), np.zeros(3)
    total, squares, slope = 0.0, 0.0, 0.0
    for k in range(len(pairs)):
        w = pairs[k, 0]
        if w == 0.0:
            continue
        total += w
        squares += (w * pairs[k, 1]) ** 2
        slope += w * w * (1 - (pairs[k, 1] / cauchy) ** 2)
        for i in range(3):
            b[i] -= w * pairs[k, 2 + i] * pairs[k, 1]
            for j in range(3):
                A[i, j] += w * pairs[k, 2 + i] * pairs[k, 2 + j]
                S[i, j] += w * pairs[k, 5 + i] * pairs[k, 5 + j]
    slope = max(slope - 3.0, 0.1 * total, 1.0)
    variance = max(least, total * squares / (slope * slope))
    return A / variance, S / variance, b / variance, variance


@kernel
def _neighbours(pairs: Array) -> tuple[float, int, Array]:
    """(correlation of the distances of neighbours, inliers, which way they hold the scan)."""
    product, squares, inliers = 0.0, 0.0, 0
    directions = np.zeros((2, 2))
    for k in range(len(pairs)):
        w, distance = pairs[k, 0], pairs[k, 1]
        if w == 0.0:
            continue
        squares += w * distance * distance
        if k > 0 and pairs[k - 1, 0] > 0.0:
            product += np.sqrt(w * pairs[k - 1, 0]) * distance * pairs[k - 1, 1]
        if w < 0.5:
            continue
        inliers += 1
        for i in range(2):
            for j in range(2):
                directions[i, j] += pairs[k, 2 + i] * pairs[k, 2 + j]
                directions[i, j] -= pairs[k, 5 + i] * pairs[k, 5 + j]
    correlation = product / squares if squares > 0.0 else 0.0
    return min(max(correlation, 0.0), 0.9), inliers, directions


@kernel
def _share(pairs: Array, owners: NDArray[np.int32], by_scan: Array) -> None:
    for k in range(len(pairs)):
        w = pairs[k, 0]
        if w == 0.0:
            continue
        for i in range(3):
            for j in range(3):
                by_scan[owners[k], i, j] += w * pairs[k, 2 + i] * pairs[k, 2 + j]
