"""Lines in normal form: the points p with n(alpha) . p = r, n = (cos alpha, sin alpha).

`r` [m] may be negative: (r, alpha) and (-r, alpha + pi) are the same points. `alpha` [rad] is
wrapped to (-pi, pi]. The tangent is u = (-sin alpha, cos alpha); t = u . p says where a point is.
Every function is vectorised over leading axes of lines (..., 2).
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from grouser.geometry import Array, wrap


def normals(alpha: ArrayLike) -> Array:
    """(..., 2) unit normals."""
    alpha = np.asarray(alpha, dtype=np.float64)
    out = np.empty((*alpha.shape, 2))
    np.cos(alpha, out=out[..., 0])
    np.sin(alpha, out=out[..., 1])
    return out


def tangents(alpha: ArrayLike) -> Array:
    """(..., 2) unit tangents, a quarter turn to the left of the normals."""
    alpha = np.asarray(alpha, dtype=np.float64)
    out = np.empty((*alpha.shape, 2))
    np.negative(np.sin(alpha), out=out[..., 0])
    np.cos(alpha, out=out[..., 1])
    return out


def line_through(a: ArrayLike, b: ArrayLike) -> Array:
    """(..., 2) the line from points a to b (..., 2), its tangent pointing from a to b.

    Two points that coincide give the line across the x axis through them.
    """
    a, b = np.asarray(a, dtype=np.float64), np.asarray(b, dtype=np.float64)
    d = b - a
    alpha = wrap(np.arctan2(d[..., 1], d[..., 0]) - np.pi / 2)
    return np.stack([np.sum(normals(alpha) * a, axis=-1), alpha], axis=-1)


def lines_in_frame(lines: ArrayLike, pose: Sequence[float] | Array) -> Array:
    """(..., 2) world lines as a robot at pose (3,) sees them: (r - n . p, alpha - heading)."""
    lines = np.asarray(lines, dtype=np.float64)
    x, y, heading = pose
    alpha = lines[..., 1]
    r = lines[..., 0] - x * np.cos(alpha) - y * np.sin(alpha)
    return np.stack([r, wrap(alpha - heading)], axis=-1)


def lines_to_world(lines: ArrayLike, pose: Sequence[float] | Array) -> Array:
    """(..., 2) lines seen from pose (3,), in the world: `lines_in_frame` undone."""
    lines = np.asarray(lines, dtype=np.float64)
    x, y, heading = pose
    alpha = wrap(lines[..., 1] + heading)
    r = lines[..., 0] + x * np.cos(alpha) + y * np.sin(alpha)
    return np.stack([r, alpha], axis=-1)


def turned_over(lines: ArrayLike) -> Array:
    """(..., 2) the same points in the other form: (-r, alpha + pi). A covariance becomes F C F,
    F = diag(-1, 1)."""
    lines = np.asarray(lines, dtype=np.float64)
    return np.stack([-lines[..., 0], wrap(lines[..., 1] + np.pi)], axis=-1)


def points_on(lines: ArrayLike, t: ArrayLike) -> Array:
    """(..., 2) the points at places t (...) [m] along lines."""
    lines, t = np.asarray(lines, dtype=np.float64), np.asarray(t, dtype=np.float64)
    along = t[..., None] * tangents(lines[..., 1])
    return np.asarray(lines[..., :1] * normals(lines[..., 1]) + along)


def places_along(lines: ArrayLike, points: ArrayLike) -> Array:
    """(...) t [m] of the feet of points (..., 2) on lines."""
    lines = np.asarray(lines, dtype=np.float64)
    return np.asarray(np.sum(tangents(lines[..., 1]) * np.asarray(points), axis=-1))
