"""Sub-pixel alignment of matched corners: Lucas-Kanade, along the row and in the plane.

Descriptors match to a pixel; visual odometry wants a tenth (SPEC 1.8). Patches are compared less
their means, so that the two eyes' or two moments' exposure may differ.
"""

import numpy as np
from numba import njit

from grouser.estimators.visual.descriptor import Image
from grouser.estimators.visual.motion import COMPILED
from grouser.geometry import Array

ROW_RADIUS = 4
"""Half the patch that aligns the two eyes, px."""
PLANE_RADIUS = 5
"""Half the patch that aligns two moments, px."""


@njit(**COMPILED)
def _sample(image: Image, x: float, y: float) -> float:
    """Bilinear grey value; the caller keeps x, y a pixel inside the image."""
    i, j = int(x), int(y)
    a, b = x - i, y - j
    top = (1 - a) * image[j, i] + a * image[j, i + 1]
    bottom = (1 - a) * image[j + 1, i] + a * image[j + 1, i + 1]
    return float((1 - b) * top + b * bottom)


@njit(**COMPILED)
def _inside(image: Image, x: float, y: float, margin: float) -> bool:
    height, width = image.shape
    return bool(margin <= x < width - 1 - margin and margin <= y < height - 1 - margin)


@njit(**COMPILED)
def align_rows(left: Image, right: Image, points: Array, limit: float) -> Array:
    """Sub-pixel disparity of points (n, 3) u, v, d [px]; NaN where it does not settle.

    A result that leaves its start by more than `limit` [px] has lost its corner.
    """
    n, size = points.shape[0], 2 * ROW_RADIUS + 1
    out = np.empty(n)
    patch = np.empty((size, size))
    for i in range(n):
        u, v, d = points[i]
        out[i] = np.nan
        if not _inside(left, u, v, ROW_RADIUS + 2.0):
            continue
        mean = 0.0
        for r in range(size):
            for c in range(size):
                patch[r, c] = _sample(left, u + c - ROW_RADIUS, v + r - ROW_RADIUS)
                mean += patch[r, c]
        mean /= size * size
        shift = 0.0
        for _ in range(10):
            x = u - d - shift
            if not _inside(right, x, v, ROW_RADIUS + 2.0) or abs(shift) > limit:
                break
            sum_g = sum_gg = sum_e = sum_ge = 0.0
            for r in range(size):
                for c in range(size):
                    xx, yy = x + c - ROW_RADIUS, v + r - ROW_RADIUS
                    g = 0.5 * (_sample(right, xx + 1, yy) - _sample(right, xx - 1, yy))
                    e = _sample(right, xx, yy) - (patch[r, c] - mean)
                    sum_g += g
                    sum_gg += g * g
                    sum_e += e
                    sum_ge += g * e
            curvature = sum_gg - sum_g * sum_g / (size * size)
            if curvature < 1.0:
                break
            # e(shift) falls by g with the shift, once its mean over the patch is taken away.
            step = (sum_ge - sum_g * sum_e / (size * size)) / curvature
            shift += step
            if abs(step) < 0.005:
                if abs(shift) <= limit:
                    out[i] = d + shift
                break
    return out


@njit(**COMPILED)
def align_plane(
    reference: Image, current: Image, points: Array, guesses: Array, scales: Array, limit: float
) -> Array:
    """Where points (n, >=2) u, v of `reference` lie in `current`; NaN where it does not settle.

    Args: guesses (n, >=2) px; scales (n,) how much larger the patch is now (d' / d).
    Returns: (n, 2) px, by inverse-compositional alignment of a patch resized by its scale.
    """
    n, size = points.shape[0], 2 * PLANE_RADIUS + 1
    out = np.full((n, 2), np.nan)
    patch, gx, gy = np.empty((size, size)), np.empty((size, size)), np.empty((size, size))
    for i in range(n):
        u, v, shrink = points[i, 0], points[i, 1], 1.0 / scales[i]
        if not _inside(reference, u, v, (PLANE_RADIUS + 1) * shrink + 1.0):
            continue
        for r in range(size):
            for c in range(size):
                x, y = u + (c - PLANE_RADIUS) * shrink, v + (r - PLANE_RADIUS) * shrink
                patch[r, c] = _sample(reference, x, y)
                gx[r, c] = 0.5 * (
                    _sample(reference, x + shrink, y) - _sample(reference, x - shrink, y)
                )
                gy[r, c] = 0.5 * (
                    _sample(reference, x, y + shrink) - _sample(reference, x, y - shrink)
                )
        gx -= gx.mean()
        gy -= gy.mean()
        xx, yy, xy = (gx * gx).sum(), (gy * gy).sum(), (gx * gy).sum()
        determinant = xx * yy - xy * xy
        if determinant < 1e-3 * (xx + yy) ** 2:
            continue  # an edge: it may slide along itself
        px, py = guesses[i, 0], guesses[i, 1]
        for _ in range(10):
            if not _inside(current, px, py, PLANE_RADIUS + 1.0):
                break
            if abs(px - guesses[i, 0]) > limit or abs(py - guesses[i, 1]) > limit:
                break
            sum_x = sum_y = 0.0
            for r in range(size):
                for c in range(size):
                    e = _sample(current, px + c - PLANE_RADIUS, py + r - PLANE_RADIUS) - patch[r, c]
                    sum_x += gx[r, c] * e
                    sum_y += gy[r, c] * e
            dx = (yy * sum_x - xy * sum_y) / determinant
            dy = (xx * sum_y - xy * sum_x) / determinant
            px -= dx
            py -= dy
            if abs(dx) < 0.005 and abs(dy) < 0.005:
                out[i, 0], out[i, 1] = px, py
                break
    return out
