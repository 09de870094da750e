"""The surface that a scan shows: its points, each with the direction the surface faces there."""

from typing import NamedTuple

import numpy as np

from grouser.estimators.line_slam.scan import Scan
from grouser.geometry import Array
from grouser.kernels import kernel


class Surface(NamedTuple):
    """n points counter-clockwise around whoever saw them, on the plane."""

    points: Array
    """(n, 2) m, as they were measured"""
    feet: Array
    """(n, 2) m, where they were fitted to the line of their neighbours"""
    normals: Array
    """(n, 2) of length 1, towards the lidar"""
    normal_sigmas: Array
    """(n,) how well the normal is known, rad; inf where the surface is no line, NaN where
    neighbours are too few to say."""
    sigma: float
    """How far a point is off the line of its neighbours, half of the time less, m"""


def surface_of(scan: Scan) -> Surface:
    """What a scan met, in its frame."""
    hit = scan.hit
    points, origins = scan.points, np.ascontiguousarray(scan.origins[hit])
    normals, sigmas = np.empty_like(points), np.empty(len(points))
    feet = points.copy()
    sigma = _fit_normals(points, origins, feet, normals, sigmas)
    return Surface(points, feet, normals, sigmas, sigma)


def own_covariance(surface: Surface) -> Array:
    """(3, 3) how far noise in its points alone moves, turns included, whatever is laid over them:
    in the frame of the surface; where they hold nothing, as far as makes no sense any more."""
    known = np.isfinite(surface.normal_sigmas)
    p, n = surface.points[known], surface.normals[known]
    J = np.column_stack([n, n[:, 1] * p[:, 0] - n[:, 0] * p[:, 1]])
    return np.asarray(np.linalg.inv(J.T @ J / surface.sigma**2 + np.diag(_HELD_BY_NOTHING**-2)))


_SIDE = 5
"""Neighbours to one side whose line a point's normal is taken from, at least,"""
_LENGTH = 0.2
"""how far they reach, at least, m,"""
_MOST = 25
"""and how many they are, at most."""
_NEAR = 0.3
"""m between neighbours of the same surface, or, where beams lie wide apart,"""
_SPREAD = 0.1
"""that share of the range: beams of 1 degree on a wall that they meet at 10 degrees."""
_THINNEST = 0.005
"""m; no surface is straighter"""
_DOUBTFUL = 0.2
"""rad: a normal less sure than this is none"""

_HELD_BY_NOTHING = np.array([0.05, 0.05, 0.02])  # m, m, rad


@kernel
def _fit_normals(
    points: Array, origins: Array, feet: Array, normals: Array, sigmas: Array
) -> float:
    """Of three windows of neighbours, before a point, about it and after it, the one on the
    straightest line tells its normal: at a corner one of them leaves out the other wall.

    The straightest of three is so by chance, too: no line counts as straighter than half of the
    windows about points are, which is returned as a sigma [m].
    """
    n = len(points)
    variances, spreads, usual = np.full(n, np.inf), np.ones(n), np.full(n, np.inf)
    for i in range(n):
        ox, oy = points[i, 0] - origins[i, 0], points[i, 1] - origins[i, 1]
        near = max(_NEAR, _SPREAD * np.hypot(ox, oy))
        first, last = _reach(points, i, -1, near, 1.0), _reach(points, i, 1, near, 1.0)
        about = _reach(points, i, -1, near, 0.5), _reach(points, i, 1, near, 0.5)
        nx, ny, off = 0.0, 0.0, 0.0
        for a, b in (about, (first, i), (i, last)):
            x, y, r, variance, spread = _line(points, a, b)
            if (a, b) == about:
                usual[i] = variance
            if variance / spread < variances[i] / spreads[i]:
                variances[i], spreads[i], nx, ny = variance, spread, x, y
                off = x * points[i, 0] + y * points[i, 1] - r
        feet[i, 0], feet[i, 1] = points[i, 0] - off * nx, points[i, 1] - off * ny
        if nx * ox + ny * oy > 0:
            nx, ny = -nx, -ny
        normals[i, 0], normals[i, 1] = nx, ny
    fitted = usual[np.isfinite(usual)]
    least = _THINNEST**2
    if len(fitted) > 0:
        least = max(least, np.median(fitted))
    for i in range(n):
        if np.isfinite(variances[i]):
            sigma = np.sqrt(max(variances[i], least) / spreads[i])
            sigmas[i] = sigma if sigma < _DOUBTFUL else np.inf
        else:
            sigmas[i] = np.nan
    return float(np.sqrt(least))


@kernel
def _reach(points: Array, i: int, step: int, near: float, share: float) -> int:
    """The last point of a window that goes from point i in steps of -1 or 1."""
    j = i
    while 0 <= j + step < len(points) and _apart(points, j, j + step) < near:
        enough = _SIDE * share <= abs(j - i) and _LENGTH * share <= _apart(points, i, j)
        if enough or abs(j - i) >= _MOST:
            break
        j += step
    return j


@kernel
def _apart(points: Array, i: int, j: int) -> float:
    return float(np.hypot(points[j, 0] - points[i, 0], points[j, 1] - points[i, 1]))


@kernel
def _line(points: Array, first: int, last: int) -> tuple[float, float, float, float, float]:
    """Normal and distance r of the line through points first to last, the variance across it of a
    point, and the sum of squares along it [m^2]; the variance is inf where they are too few."""
    n = last - first + 1
    if n < 4:
        return 0.0, 0.0, 0.0, np.inf, 1.0
    x, y = 0.0, 0.0
    for i in range(first, last + 1):
        x += points[i, 0]
        y += points[i, 1]
    x, y = x / n, y / n
    xx, xy, yy = 0.0, 0.0, 0.0
    for i in range(first, last + 1):
        dx, dy = points[i, 0] - x, points[i, 1] - y
        xx += dx * dx
        xy += dx * dy
        yy += dy * dy
    alpha = 0.5 * np.arctan2(-2 * xy, yy - xx)  # total least squares, SPEC 2.5 step 3
    c, s = np.cos(alpha), np.sin(alpha)
    across = c * c * xx + 2 * c * s * xy + s * s * yy
    along = s * s * xx - 2 * c * s * xy + c * c * yy
    if along <= 0.0:
        return 0.0, 0.0, 0.0, np.inf, 1.0
    return c, s, c * x + s * y, across / (n - 2), along
