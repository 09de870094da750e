"""Which face is seen where: scan-line filling of convex polygons into a depth buffer.

One call fills one sub-sample of all pixels; supersampling is one call a sub-sample.
"""

import math
from typing import Any, Final

import numpy as np

from grouser.kernels import kernel

SUBSAMPLES: Final = {
    1: np.zeros((1, 2), dtype=np.float32),
    4: np.array(
        [[-0.125, -0.375], [0.375, -0.125], [0.125, 0.375], [-0.375, 0.125]], dtype=np.float32
    ),
}
"""Where a pixel is sampled, px from its centre: once, or on a rotated grid of four."""

_SHORT: Final = 12  # px, where vector instructions are not worth their beginning
SKY: Final = -1
"""The face of a pixel that shows none."""


@kernel
def cover(visible: Any, n: int, dx: float, dy: float, depth: Any, faces: Any) -> None:
    """Find the nearest face at every pixel's sub-sample.

    Args:
        visible: a `Visible` of n polygons.
        dx, dy: where in the pixel to sample, px from its centre.
        depth: out, (height, width) inverse depth, 1/m.
        faces: out, (height, width) index of the polygon, or SKY.
    """
    height, width = depth.shape
    depth[:, :] = np.float32(0)
    faces[:, :] = SKY
    for i in range(n):
        polygon, count, plane = visible.polygons[i], visible.n_corners[i], visible.planes[i]
        first, last = _rows(polygon, count, dy, height)
        for row in range(first, last):
            begin, end = _span(polygon, count, row + dy, dx, width)
            w0 = plane[0] * dx + plane[1] * (row + dy) + plane[2]
            if end - begin > _SHORT:
                _fill(depth[row], faces[row], begin, end, plane[0], w0, i)
            else:
                for x in range(begin, end):
                    w = np.float32(w0 + plane[0] * x)
                    if w > depth[row, x]:
                        depth[row, x], faces[row, x] = w, i


@kernel
def _rows(polygon: Any, n: int, dy: float, height: int) -> Any:
    """First row whose sample may lie inside, and one past the last."""
    top, bottom = polygon[0, 1], polygon[0, 1]
    for k in range(1, n):
        top, bottom = min(top, polygon[k, 1]), max(bottom, polygon[k, 1])
    # Clamped before the conversion: a corner near the camera's plane may be beyond any integer.
    first = math.ceil(min(max(top - dy, 0.0), float(height)))
    last = math.floor(min(max(bottom - dy, -1.0), height - 1.0))
    return int(first), int(last) + 1


@kernel
def _span(polygon: Any, n: int, y: float, dx: float, width: int) -> Any:
    """First column whose sample lies inside at height y, and one past the last."""
    left, right = np.inf, -np.inf
    for k in range(n):
        x1, y1 = polygon[k, 0], polygon[k, 1]
        following = k + 1 if k + 1 < n else 0
        x2, y2 = polygon[following, 0], polygon[following, 1]
        if (y1 <= y) != (y2 <= y):
            if y2 < y1:  # upwards, whichever way the face walks: no crack between neighbours
                x1, y1, x2, y2 = x2, y2, x1, y1
            crossing = x1 + (y - y1) / (y2 - y1) * (x2 - x1)
            left, right = min(left, crossing), max(right, crossing)
    begin = math.ceil(min(max(left - dx, 0.0), float(width)))
    end = math.ceil(min(max(right - dx, 0.0), float(width)))
    return int(begin), int(end)


@kernel
def _fill(
    depth: Any, faces: Any, begin: int, end: int, slope: float, offset: float, face: int
) -> None:
    # Views that begin at zero, and selections instead of branches: for vector instructions.
    nearest, seen, start = depth[begin:end], faces[begin:end], offset + slope * begin
    for k in range(nearest.size):
        w = np.float32(start + slope * np.int32(k))
        nearer = w > nearest[k]
        nearest[k] = w if nearer else nearest[k]
        seen[k] = np.int32(face) if nearer else seen[k]


@kernel
def read_depth(visible: Any, faces: Any, depth: Any) -> None:
    """Fill in the depth (height, width) [m] of the faces that `cover` found; inf for sky."""
    for y in range(faces.shape[0]):
        for x in range(faces.shape[1]):
            i = faces[y, x]
            depth[y, x] = np.inf
            if i >= 0:
                p = visible.planes[i]
                depth[y, x] = 1 / (p[0] * x + p[1] * y + p[2])
