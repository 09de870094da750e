"""Sub-pixel alignment of matched corners between two moments: Lucas-Kanade in the plane.

Descriptors match to a pixel; visual odometry wants a tenth (SPEC 1.8). Patches are compared less
their means, so that the exposure may differ.
"""

import numpy as np

from grouser.estimators.visual.descriptor import Image
from grouser.geometry import Array
from grouser.kernels import kernel

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
def inside(image: Image, x: float, y: float, margin: float) -> bool:
    """Whether a place and what is so near to it [px] can be interpolated."""
    height, width = image.shape
    return bool(margin <= x < width - 1 - margin and margin <= y < height - 1 - margin)


_SETTLED = 0.01  # px


@kernel
def align_plane(
    reference: Image, current: Image, points: Array, guesses: Array, warps: Array, limit: float
) -> Array:
    """Where points (n, >=2) u, v of `reference` lie in `current`; NaN where it does not settle.

    Args: guesses (n, >=2) px; warps (n, 2, 2) how offsets in the reference patch appear now.
    Returns: (n, 4) u, v [px], by inverse-compositional alignment of the warped patch, and the
    variances of both per squared grey level of noise: an edge hardly tells where along it one is.
    """
    n, size = points.shape[0], 2 * PLANE_RADIUS + 1
    out = np.full((n, 4), np.nan)
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
            if lost or not inside(current, x, y, PLANE_RADIUS + 1.0):
                break
            cut_patch(current, x - PLANE_RADIUS, y - PLANE_RADIUS, seen)
            sum_x, sum_y = _mismatch(seen, patch, gx, gy)
            dx = (yy * sum_x - xy * sum_y) / determinant
            dy = (xx * sum_y - xy * sum_x) / determinant
            x -= dx
            y -= dy
            if abs(dx) < _SETTLED and abs(dy) < _SETTLED:
                out[i, 0], out[i, 1] = x, y
                out[i, 2], out[i, 3] = yy / determinant, xx / determinant
                break
    return out


@kernel
def cut_patch(image: Image, x: float, y: float, patch: Array) -> None:
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
    if not inside(image, u, v, reach):
        return False
    for row in range(patch.shape[0]):
        for column in range(patch.shape[0]):
            dx, dy = column - middle, row - middle
            patch[row, column] = _sample(image, u + a * dx + b * dy, v + c * dx + d * dy)
    return True
