"""Sub-pixel alignment of the two eyes: Lucas-Kanade along the row, and how far off the row was.

Patches are compared less their means, so that the eyes' exposure may differ.
"""

import numpy as np

from grouser.estimators.visual.alignment import cut_patch, inside
from grouser.estimators.visual.descriptor import Image
from grouser.geometry import Array
from grouser.kernels import kernel, kernel_using

ROW_RADIUS = 4
"""Half the patch that aligns the two eyes, px."""


@kernel_using(inside, cut_patch)
def align_rows(
    left: Image, right: Image, points: Array, lower: Array, limit: float
) -> tuple[Array, Array]:
    """Sub-pixel disparity and its slopes (n, 3) of points (n, 3) u, v, d [px].

    The patch is taken for a piece of a plane: d(x, y) = d + slope_x x + slope_y y. On the ground
    before a robot the disparity grows by baseline / height, about 0.3 px, from row to row; a patch
    with one disparity would be matched where it happens to have texture.
    NaN where it does not settle, or leaves its start by more than `limit` [px].

    Args:
        lower: (n,) by how many rows the right eye sees the points lower than the left, px.

    Returns: besides, (n, 2) how much lower still they seem [px], and how much texture says so.
    """
    n, size = points.shape[0], 2 * ROW_RADIUS + 1
    out, off = np.full((n, 3), np.nan), np.full((n, 2), np.nan)
    patch = np.empty((size, size))
    # Values and slopes of the rows in which the patch is sought, cut out once for all iterations.
    strip, rise = np.empty((size, 2 * _STRIP + 1)), np.empty((size, 2 * _STRIP + 1))
    plane, step = np.empty(3), np.empty(3)
    for i in range(n):
        u, v, d = points[i]
        row = v + lower[i]
        if not inside(left, u, v, ROW_RADIUS + 1.0):
            continue
        if not inside(right, u - d, row, ROW_RADIUS + 1.0):
            continue
        cut_patch(left, u - ROW_RADIUS, v - ROW_RADIUS, patch)
        origin = int(u - d)
        _cut_strip(right, origin, row, strip, rise)
        plane[:] = 0.0
        for _ in range(12):
            if not _row_step(strip, rise, patch, u - d - origin, plane, step):
                break
            plane += step
            if abs(plane[0]) > limit:
                break
            if max(abs(step[0]), ROW_RADIUS * abs(step[1]), ROW_RADIUS * abs(step[2])) < _SETTLED:
                out[i, 0], out[i, 1], out[i, 2] = d + plane[0], plane[1], plane[2]
                off[i] = _row_error(strip, rise, patch, u - d - origin, plane)
                break
    return out, off


@kernel
def _row_error(
    strip: Array, rise: Array, patch: Array, x: float, plane: Array
) -> tuple[float, float]:
    """How many rows lower than the strip's the patch is seen, once its disparity has settled, and
    the texture that says so: the sum of squared slopes across the rows, less what the disparity
    would explain as well."""
    size = patch.shape[0]
    e0 = s0 = t0 = xx = xy = yy = gx = gy = 0.0
    for r in range(1, size - 1):
        dy = float(r - ROW_RADIUS)
        for c in range(size):
            dx = float(c - ROW_RADIUS)
            place = x + dx - plane[0] - plane[1] * dx - plane[2] * dy + _STRIP
            if not 1.0 <= place < 2 * _STRIP - 1:
                return 0.0, 0.0
            k = int(place)
            a = place - k
            e = (1 - a) * strip[r, k] + a * strip[r, k + 1] - patch[r, c]
            along = (1 - a) * rise[r, k] + a * rise[r, k + 1]
            down = strip[r + 1, k] - strip[r - 1, k]
            down = 0.5 * ((1 - a) * down + a * (strip[r + 1, k + 1] - strip[r - 1, k + 1]))
            e0, s0, t0 = e0 + e, s0 + along, t0 + down
            xx, xy, yy = xx + along * along, xy + along * down, yy + down * down
            gx, gy = gx + along * e, gy + down * e
    count = float(size * (size - 2))
    xx, xy, yy = xx - s0 * s0 / count, xy - s0 * t0 / count, yy - t0 * t0 / count
    gx, gy = gx - s0 * e0 / count, gy - t0 * e0 / count
    if xx < _FLAT:
        return 0.0, 0.0
    texture = yy - xy * xy / xx
    if texture < _FLAT:
        return 0.0, 0.0
    return -(gy - xy * gx / xx) / texture, texture


_STRIP = 14  # px to either side: the patch, its slopes and the way it may go
_SETTLED = 0.01  # px
_SLOPE_STIFFNESS = 400.0  # (grey levels of noise / likely slope)^2: a flat patch holds no slope


@kernel
def _cut_strip(image: Image, origin: int, y: float, strip: Array, rise: Array) -> None:
    """Rows around y, interpolated, from origin - _STRIP on; beyond the image its edge repeats."""
    height, width = image.shape
    for r in range(strip.shape[0]):
        yy = y + r - ROW_RADIUS
        j = int(yy)
        b = yy - j
        for k in range(2 * _STRIP + 1):
            x = min(max(origin + k - _STRIP, 0), width - 1)
            strip[r, k] = (1 - b) * image[j, x] + b * image[j + 1, x]
        rise[r, 0] = rise[r, 2 * _STRIP] = 0.0
        for k in range(1, 2 * _STRIP):
            rise[r, k] = 0.5 * (strip[r, k + 1] - strip[r, k - 1])


@kernel
def _row_step(strip: Array, rise: Array, patch: Array, x: float, plane: Array, step: Array) -> bool:
    """Gauss-Newton step of (disparity, slope_x, slope_y); False where the patch leaves the strip.

    x: where the patch's middle starts from, px from the strip's origin.
    """
    size = patch.shape[0]
    e0 = s0 = s1 = s2 = h00 = h01 = h02 = h11 = h12 = h22 = g0 = g1 = g2 = 0.0
    for r in range(size):
        dy = float(r - ROW_RADIUS)
        for c in range(size):
            dx = float(c - ROW_RADIUS)
            place = x + dx - plane[0] - plane[1] * dx - plane[2] * dy + _STRIP
            if not 1.0 <= place < 2 * _STRIP - 1:
                return False
            k = int(place)
            a = place - k
            e = (1 - a) * strip[r, k] + a * strip[r, k + 1] - patch[r, c]
            b0 = (1 - a) * rise[r, k] + a * rise[r, k + 1]
            b1, b2 = b0 * dx, b0 * dy
            e0, s0, s1, s2 = e0 + e, s0 + b0, s1 + b1, s2 + b2
            h00, h01, h02 = h00 + b0 * b0, h01 + b0 * b1, h02 + b0 * b2
            h11, h12, h22 = h11 + b1 * b1, h12 + b1 * b2, h22 + b2 * b2
            g0, g1, g2 = g0 + b0 * e, g1 + b1 * e, g2 + b2 * e
    # Less the patch's means: the eyes' exposure may differ.
    count = float(size * size)
    stiff = _SLOPE_STIFFNESS
    h00, h01, h02 = h00 - s0 * s0 / count, h01 - s0 * s1 / count, h02 - s0 * s2 / count
    h11, h12 = h11 - s1 * s1 / count + stiff, h12 - s1 * s2 / count
    h22 = h22 - s2 * s2 / count + stiff
    g0, g1, g2 = g0 - s0 * e0 / count, g1 - s1 * e0 / count, g2 - s2 * e0 / count
    g1, g2 = g1 - stiff * plane[1], g2 - stiff * plane[2]
    c00, c01, c02 = h11 * h22 - h12 * h12, h02 * h12 - h01 * h22, h01 * h12 - h02 * h11
    determinant = h00 * c00 + h01 * c01 + h02 * c02
    if h00 < _FLAT or determinant <= 0.0:
        return False
    c11, c12, c22 = h00 * h22 - h02 * h02, h01 * h02 - h00 * h12, h00 * h11 - h01 * h01
    step[0] = (c00 * g0 + c01 * g1 + c02 * g2) / determinant
    step[1] = (c01 * g0 + c11 * g1 + c12 * g2) / determinant
    step[2] = (c02 * g0 + c12 * g1 + c22 * g2) / determinant
    return True


_FLAT = 100.0  # sum of squared slopes along the row, below which nothing holds the disparity
