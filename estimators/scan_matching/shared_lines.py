"""The lines that several scans together tell of a surface, worked out where one is asked for.

Of many scans of one wall, noise and errors of their poses lay some on either side of it. The point
nearest to where another scan's point is looked for is then of whichever lies there, so that the
other scan is at rest wherever it is among them: the more scans, the softer their hold, and the
wider the way drifts. Their mean holds it.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from grouser.estimators.scan_matching.surface import Surface
from grouser.geometry import Array
from grouser.kernels import kernel


class SharedLines(NamedTuple):
    """Of n points of k scans; `known` and `lines` are filled as lines are asked for."""

    low: Array
    """(2,) corner of the first bin, m"""
    first: NDArray[np.int32]
    """(rows, columns + 1) where the points of each square bin of a side of ALONG begin, row by
    row; they end where the next ones begin"""
    sorted: Array
    """(n, 5) foot, normal and the sigma of that, of points that are on lines, bin by bin"""
    scans: NDArray[np.int32]
    """(n,) which scan each is of"""
    known: NDArray[np.bool_]
    """(n,) whether a line was worked out, of the points as they are in the surface"""
    lines: Array
    """(n, 4) its foot [m], and its normal"""
    nearest: tuple[Array, NDArray[np.int32]]
    """(k,), (k,) room for the nearest point of each scan"""


def shared_lines(surface: Surface, scans: NDArray[np.int32], k: int) -> SharedLines:
    """Of k scans laid together as one surface, of which `scans` (n,) says which point is whose."""
    points, n = surface.points, len(surface.points)
    low, high = (points.min(axis=0), points.max(axis=0)) if n else (np.zeros(2), np.zeros(2))
    size = np.floor((high - low) / ALONG).astype(int) + 1
    first = np.zeros((size[0], size[1] + 1), dtype=np.int32)
    ordered, whose = np.empty((n, 5)), np.empty(n, dtype=np.int32)
    _sort(surface, scans, low, first, ordered, whose)
    room = np.empty(k), np.empty(k, dtype=np.int32)
    known = np.zeros(n, dtype=np.bool_)
    return SharedLines(low, first, ordered, whose, known, np.empty((n, 4)), room)


@kernel
def _sort(
    surface: Surface,
    scans: NDArray[np.int32],
    low: Array,
    first: NDArray[np.int32],
    ordered: Array,
    whose: NDArray[np.int32],
) -> None:
    """Points on lines, by their bins."""
    points, feet, normals, sigmas, _ = surface
    bins = np.empty(len(points), dtype=np.int64)
    begin = first.reshape(-1)
    for p in range(len(points)):
        i, j = int((points[p, 0] - low[0]) / ALONG), int((points[p, 1] - low[1]) / ALONG)
        bins[p] = i * first.shape[1] + j if np.isfinite(sigmas[p]) else -1
        if bins[p] >= 0:
            begin[bins[p] + 1] += 1
    for b in range(1, len(begin)):
        begin[b] += begin[b - 1]
    at = begin.copy()
    for p in range(len(points)):
        if bins[p] >= 0:
            q = at[bins[p]]
            at[bins[p]] += 1
            ordered[q, 0], ordered[q, 1] = feet[p, 0], feet[p, 1]
            ordered[q, 2], ordered[q, 3], ordered[q, 4] = normals[p, 0], normals[p, 1], sigmas[p]
            whose[q] = scans[p]


@kernel
def line_at(surface: Surface, shared: SharedLines, p: int) -> Array:
    """(4,) the line at a point that is on one: the mean of those of all scans, each by its point
    nearest along it."""
    line: Array = shared.lines[p]
    if shared.known[p]:
        return line
    points, feet, normals, _, _ = surface
    others, scans = shared.sorted, shared.scans
    distances, nearest = shared.nearest
    distances[:], nearest[:] = ALONG, -1
    fx, fy, nx, ny = feet[p, 0], feet[p, 1], normals[p, 0], normals[p, 1]
    row = int((points[p, 0] - shared.low[0]) / ALONG)
    column = int((points[p, 1] - shared.low[1]) / ALONG)
    last = min(column + 2, shared.first.shape[1] - 1)
    for i in range(max(row - 1, 0), min(row + 2, shared.first.shape[0])):
        for q in range(shared.first[i, max(column - 1, 0)], shared.first[i, last]):
            dx, dy = others[q, 0] - fx, others[q, 1] - fy
            along, across = abs(nx * dy - ny * dx), abs(nx * dx + ny * dy)
            if along < distances[scans[q]] and across < _ACROSS:
                if nx * others[q, 2] + ny * others[q, 3] > _ALIKE:
                    distances[scans[q]], nearest[scans[q]] = along, q
    count, off, mx, my = 0, 0.0, 0.0, 0.0
    for q in nearest:
        if q >= 0:
            # Where the normal at p meets the line of q, whose own direction allows for the way.
            mq, nq = others[q, 2], others[q, 3]
            dx, dy = others[q, 0] - fx, others[q, 1] - fy
            count, off = count + 1, off + (dx * mq + dy * nq) / (nx * mq + ny * nq)
            weight = 1 / others[q, 4] ** 2
            mx, my = mx + weight * mq, my + weight * nq
    length = np.hypot(mx, my)
    line[0], line[1] = fx + off / count * nx, fy + off / count * ny
    line[2], line[3] = mx / length, my / length
    shared.known[p] = True
    return line


ALONG = 0.2
"""m along a line over which it goes on, as far as a normal's neighbours reach at least,"""
_ACROSS = 0.15
"""m across, beyond which it is another one,"""
_ALIKE = 0.9
"""and cosine between normals, above which it is the same."""
