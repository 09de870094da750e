"""Which face is seen where: convex polygons filled into a depth buffer, a row of pixels at a time,
so that a row stays in the processor's nearest memory until its colours are known."""

import math
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

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


class Rows(NamedTuple):
    """Which polygons may show in each row of pixels, as `list_rows` gives them."""

    begins: NDArray[np.int32]
    """(height + 1,) where a row's polygons begin in `polygons`, and where they end."""
    polygons: NDArray[np.int32]
    """Their indices, ascending within a row."""


@kernel
def list_rows(visible: Any, n: int, height: int) -> Any:
    """The `Rows` of the first n polygons of a `Visible`."""
    begins = np.zeros(height + 1, dtype=np.int32)
    for i in range(n):
        first, end = _rows(visible.polygons[i], visible.n_corners[i], height)
        for row in range(first, end):
            begins[row + 1] += 1
    for row in range(height):
        begins[row + 1] += begins[row]
    polygons, filled = np.empty(begins[height], dtype=np.int32), begins[:-1].copy()
    for i in range(n):
        first, end = _rows(visible.polygons[i], visible.n_corners[i], height)
        for row in range(first, end):
            polygons[filled[row]] = i
            filled[row] += 1
    return Rows(begins, polygons)


@kernel
def _rows(polygon: Any, n: int, height: int) -> Any:
    """First row in which a sample may lie inside, and one past the last."""
    top, bottom = polygon[0, 1], polygon[0, 1]
    for k in range(1, n):
        top, bottom = min(top, polygon[k, 1]), max(bottom, polygon[k, 1])
    # Clamped before the conversion: a corner near the camera's plane may be beyond any integer.
    first = math.ceil(min(max(top - 0.5, 0.0), float(height)))
    last = math.floor(min(max(bottom + 0.5, -1.0), height - 1.0))
    return int(first), int(last) + 1


@kernel
def cover(visible: Any, rows: Any, y: int, subsamples: Any, depth: Any, faces: Any) -> None:
    """Find the nearest face at every sub-sample of a row of pixels.

    Args:
        visible: a `Visible`.
        rows: its `Rows`.
        y: the row.
        subsamples: (S, 2) float32 of SUBSAMPLES.
        depth: out, (S, width) inverse depth, 1/m.
        faces: out, (S, width) index of the polygon, or SKY.
    """
    width = depth.shape[1]
    depth[:, :] = np.float32(0)
    faces[:, :] = SKY
    for member in range(rows.begins[y], rows.begins[y + 1]):
        i = rows.polygons[member]
        polygon, count, plane = visible.polygons[i], visible.n_corners[i], visible.planes[i]
        for s in range(subsamples.shape[0]):
            dx, dy = float(subsamples[s, 0]), float(subsamples[s, 1])
            begin, end = _span(polygon, count, y + dy, dx, width)
            w0 = plane[0] * dx + plane[1] * (y + dy) + plane[2]
            if end - begin > _SHORT:
                _fill(depth[s], faces[s], begin, end, plane[0], w0, i)
            else:
                for x in range(begin, end):
                    w = np.float32(w0 + plane[0] * x)
                    if w > depth[s, x]:
                        depth[s, x], faces[s, x] = w, i


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
