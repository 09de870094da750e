"""Sub-pixel alignment of matched corners: Lucas-Kanade, along the row and in the plane.

Descriptors match to a pixel; visual odometry wants a tenth (SPEC 1.8). Patches are compared less
their means, so that the two eyes' or two moments' exposure may differ.
"""

import numpy as np

from grouser.estimators.visual.descriptor import Image
from grouser.geometry import Array
from grouser.kernels import kernel

ROW_RADIUS = 4
"""Half the patch that aligns the two eyes, px."""
PLANE_RADIUS = 5
"""Half the patch that aligns two moments, px."""


@kernel
def _sample(image: Image, x: float, y: float) -> float:
    """Bilinear grey value; the caller keeps x, y a pixel inside the image."""
    i, j = int(x), int(y)
    a, b = x - i, y - j
    top = (1 - a) * image[j, i] + a * image[j, i + 1]
    bottom = (1 - a) * image[j + 1, i] + a * image[j + 1, i + 1]
    return float((1 - b) * top + b * bottom)


@kernel
def _inside(image: Image, x: float, y: float, margin: float) -> bool:
    height, width = image.shape
    return bool(margin <= x < width - 1 - margin and margin <= y < height - 1 - margin)


@kernel
def align_rows(left: Image, right: Image, points: Array, limit: float) -> Array:
    """Sub-pixel disparity and its slopes (n, 3) of points (n, 3) u, v, d [px].

    The patch is taken for a piece of a plane: d(x, y) = d + slope_x x + slope_y y. On the ground
    before a robot the disparity grows by baseline / height, about 0.3 px, from row to row; a patch
    with one disparity would be matched where it happens to have texture.
    NaN where it does not settle, or leaves its start by more than `limit` [px].
    """
    n, size = points.shape[0], 2 * ROW_RADIUS + 1
    out = np.full((n, 3), np.nan)
    patch = np.empty((size, size))
    # Values and slopes of the rows in which the patch is sought, cut out once for all iterations.
    strip, rise = np.empty((size, 2 * _STRIP + 1)), np.empty((size, 2 * _STRIP + 1))
    plane, step = np.empty(3), np.empty(3)
    for i in range(n):
        u, v, d = points[i]
        if not _inside(left, u, v, ROW_RADIUS + 1.0):
            continue
        if not _inside(right, u - d, v, ROW_RADIUS + 1.0):
            continue
        _cut_patch(left, u - ROW_RADIUS, v - ROW_RADIUS, patch)
        origin = int(u - d)
        _cut_strip(right, origin, v, strip, rise)
        plane[:] = 0.0
        for _ in range(12):
            if not _row_step(strip, rise, patch, u - d - origin, plane, step):
                break
            plane += step
            if abs(plane[0]) > limit:
                break
            if max(abs(step[0]), ROW_RADIUS * abs(step[1]), ROW_RADIUS * abs(step[2])) < _SETTLED:
                out[i, 0], out[i, 1], out[i, 2] = d + plane[0], plane[1], plane[2]
                break
    return out


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


@kernel
def align_plane(
    reference: Image, current: Image, points: Array, guesses: Array, warps: Array, limit: float
) -> Array:
    """Where points (n, >=2) u, v of `reference` lie in `current`; NaN where it does not settle.

    Args: guesses (n, >=2) px; warps (n, 2, 2) how offsets in the reference patch appear now.
    Returns: (n, 2) px, by inverse-compositional alignment of the warped patch.
    """
    n, size = points.shape[0], 2 * PLANE_RADIUS + 1
    out = np.full((n, 2), np.nan)
    patch, seen = np.empty((size + 2, size + 2)), np.empty((size, size))
    gx, gy = np.empty((size, size)), np.empty((size, size))
    for i in range(n):
        if not _warped_patch(reference, points[i, 0], points[i, 1], warps[i], patch):
            continue
        xx, xy, yy = _gradients(patch, gx, gy)
        determinant = xx * yy - xy * xy
        if determinant < 1e-3 * (xx + yy) ** 2:
            continue  # an edge: it may slide along itself
        x, y = guesses[i, 0], guesses[i, 1]
        for _ in range(10):
            lost = abs(x - guesses[i, 0]) > limit or abs(y - guesses[i, 1]) > limit
            if lost or not _inside(current, x, y, PLANE_RADIUS + 1.0):
                break
            _cut_patch(current, x - PLANE_RADIUS, y - PLANE_RADIUS, seen)
            sum_x, sum_y = _mismatch(seen, patch, gx, gy)
            dx = (yy * sum_x - xy * sum_y) / determinant
            dy = (xx * sum_y - xy * sum_x) / determinant
            x -= dx
            y -= dy
            if abs(dx) < _SETTLED and abs(dy) < _SETTLED:
                out[i, 0], out[i, 1] = x, y
                break
    return out


@kernel
def _cut_patch(image: Image, x: float, y: float, patch: Array) -> None:
    """The piece of the image whose first pixel is at x, y, interpolated; all of it is inside."""
    i, j = int(x), int(y)
    a, b = x - i, y - j
    w00, w01, w10, w11 = (1 - a) * (1 - b), a * (1 - b), (1 - a) * b, a * b
    rows, columns = patch.shape
    window = image[j : j + rows + 1, i : i + columns + 1]
    for r in range(rows):
        for c in range(columns):
            patch[r, c] = (
                w00 * window[r, c]
                + w01 * window[r, c + 1]
                + w10 * window[r + 1, c]
                + w11 * window[r + 1, c + 1]
            )


@kernel
def _mismatch(seen: Array, patch: Array, gx: Array, gy: Array) -> tuple[float, float]:
    """What the patch (with a pixel around it) seems moved by, times the gradients' products."""
    size = seen.shape[0]
    # A sum for each column: added up in this order, columns go side by side through the processor.
    sums = np.zeros((2, size))
    for r in range(size):
        for c in range(size):
            e = seen[r, c] - patch[r + 1, c + 1]
            sums[0, c] += gx[r, c] * e
            sums[1, c] += gy[r, c] * e
    return sums[0].sum(), sums[1].sum()


@kernel
def _gradients(patch: Array, gx: Array, gy: Array) -> tuple[float, float, float]:
    """Gradients less their means, and the sums of xx, xy and yy of them."""
    size = gx.shape[0]
    sum_x = sum_y = 0.0
    for r in range(size):
        for c in range(size):
            gx[r, c] = 0.5 * (patch[r + 1, c + 2] - patch[r + 1, c])
            gy[r, c] = 0.5 * (patch[r + 2, c + 1] - patch[r, c + 1])
            sum_x += gx[r, c]
            sum_y += gy[r, c]
    mean_x, mean_y = sum_x / size**2, sum_y / size**2
    xx = xy = yy = 0.0
    for r in range(size):
        for c in range(size):
            gx[r, c] -= mean_x
            gy[r, c] -= mean_y
            xx += gx[r, c] * gx[r, c]
            xy += gx[r, c] * gy[r, c]
            yy += gy[r, c] * gy[r, c]
    return xx, xy, yy


@kernel
def _warped_patch(image: Image, u: float, v: float, warp: Array, patch: Array) -> bool:
    """The patch around u, v as it appears now; False where the warp is degenerate or leads outside.

    patch: (size, size), a pixel more on every side than is compared, for the gradients.
    """
    determinant = warp[0, 0] * warp[1, 1] - warp[0, 1] * warp[1, 0]
    if not 0.2 < determinant < 5.0:
        return False
    a, b = warp[1, 1] / determinant, -warp[0, 1] / determinant
    c, d = -warp[1, 0] / determinant, warp[0, 0] / determinant
    middle = patch.shape[0] // 2
    reach = middle * max(abs(a) + abs(b), abs(c) + abs(d)) + 1.0
    if not _inside(image, u, v, reach):
        return False
    for row in range(patch.shape[0]):
        for column in range(patch.shape[0]):
            dx, dy = column - middle, row - middle
            patch[row, column] = _sample(image, u + a * dx + b * dy, v + c * dx + d * dy)
    return True
