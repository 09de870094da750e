"""Where rays first meet the ground: a march from line to line of its grid of triangles, exact.

Along a ray the ground's height is linear between the grid's lines and the diagonals of its cells
(Amanatides and Woo, Eurographics 1987, with a third family of lines). Blocks of cells that the ray
passes well above are left out.
"""

import math
from typing import Any

import numpy as np

from grouser.envs.simulation.ground import Ground, ground_at
from grouser.geometry import Array
from grouser.kernels import kernel, kernel_using

_BLOCK = 4
"""Cells along the side of a block."""
_MARGIN = 0.01
"""Above the highest ground of a block its march begins, m: on it, rounding could slip under it."""


class GroundGrid:
    """A ground, with what a march needs to know of it."""

    def __init__(self, ground: Ground) -> None:
        self._heights, self._cell, self._origin = ground.heights, ground.cell, ground.origin
        self._crests = block_crests(ground.heights)

    def shorten(self, origins: Array, directions: Array, distance: Array) -> None:
        """Shorten distances (n,) along unit directions (n, 3) to where rays come down on it.

        The rays start at one origin (1, 3), or each at its own (n, 3).
        """
        _meet_ground(
            origins, directions, self._heights, self._crests, self._cell, self._origin, distance
        )


def block_crests(heights: Array) -> Array:
    """(rows, columns) of blocks: the highest node of each, its border included, m."""
    rows, columns = (max(-(-(n - 1) // _BLOCK), 1) for n in heights.shape)
    padded = np.pad(
        heights,
        ((0, rows * _BLOCK + 1 - heights.shape[0]), (0, columns * _BLOCK + 1 - heights.shape[1])),
        mode="edge",
    )
    windows = np.lib.stride_tricks.sliding_window_view(padded, (_BLOCK + 1, _BLOCK + 1))
    return np.asarray(windows[::_BLOCK, ::_BLOCK].max(axis=(2, 3)))


@kernel_using(ground_at)
def _meet_ground(
    origins: Any, directions: Any, heights: Any, crests: Any, cell: float, corner: Any, out: Any
) -> None:
    lowest, highest = crests.min(), crests.max()
    level = highest == lowest == heights.min()
    several = origins.shape[0] > 1
    for i in range(directions.shape[0]):
        o = i if several else 0
        z, dz = origins[o, 2], directions[i, 2]
        if level:
            out[i] = _come_down(z - lowest, dz, out[i])
            continue
        begin, end = _below(highest + _MARGIN, z, dz, out[i])
        if begin < end:
            u, v = (origins[o, 0] - corner[0]) / cell, (origins[o, 1] - corner[1]) / cell
            du, dv = directions[i, 0] / cell, directions[i, 1] / cell
            met = _march_blocks(u, v, z, du, dv, dz, begin, end, heights, crests)
            out[i] = min(out[i], met)


@kernel
def _come_down(above: float, dz: float, limit: float) -> float:
    """Where a ray meets a level ground, at most limit."""
    return min(limit, -above / dz) if dz < 0.0 < above else limit


@kernel
def _below(height: float, z: float, dz: float, limit: float) -> Any:
    """The part of [0, limit] on which a ray is no higher than a height."""
    if dz == 0.0:
        return (0.0, limit) if z <= height else (limit, 0.0)
    crossing = (height - z) / dz
    return (max(0.0, crossing), limit) if dz < 0.0 else (0.0, min(limit, crossing))


@kernel_using(ground_at)
def _march_blocks(
    u: float, v: float, z: float, du: float, dv: float, dz: float, begin: float, end: float,
    heights: Any, crests: Any,
) -> Any:  # fmt: skip
    """Where a ray comes from above to below the ground within (begin, end]; infinity if nowhere.

    u and v are in cells from the corner of the grid, as du and dv for a metre of the ray.
    """
    rows, columns = crests.shape
    lines_u, at_u, apart_u = _lines(u / _BLOCK, du / _BLOCK, begin, 1, columns - 1)
    lines_v, at_v, apart_v = _lines(v / _BLOCK, dv / _BLOCK, begin, 1, rows - 1)
    t = begin
    while t < end:
        then = min(at_u, at_v, end)
        middle = (t + then) / 2
        column = min(max(int((u + middle * du) / _BLOCK), 0), columns - 1)
        row = min(max(int((v + middle * dv) / _BLOCK), 0), rows - 1)
        if z + dz * (then if dz < 0.0 else t) < crests[row, column] + _MARGIN:
            met = _march_cells(u, v, z, du, dv, dz, t, then, heights)
            if met < np.inf:
                return met
        t = then
        if at_u == then:
            lines_u, at_u = lines_u - 1, at_u + apart_u if lines_u > 1 else np.inf
        if at_v == then:
            lines_v, at_v = lines_v - 1, at_v + apart_v if lines_v > 1 else np.inf
    return np.inf


@kernel_using(ground_at)
def _march_cells(
    u: float, v: float, z: float, du: float, dv: float, dz: float, begin: float, end: float,
    heights: Any,
) -> Any:  # fmt: skip
    """The same, without leaving anything out."""
    rows, columns = heights.shape[0] - 1, heights.shape[1] - 1
    lines_u, at_u, apart_u = _lines(u, du, begin, 0, columns)
    lines_v, at_v, apart_v = _lines(v, dv, begin, 0, rows)
    lines_w, at_w, apart_w = _lines(u - v, du - dv, begin, -rows, columns)
    t, above = begin, z + begin * dz - _height(heights, u + begin * du, v + begin * dv)
    while t < end:
        then = min(at_u, at_v, at_w, end)
        then_above = z + then * dz - _height(heights, u + then * du, v + then * dv)
        if then_above <= 0.0 < above:
            return t + (then - t) * above / (above - then_above)
        t, above = then, then_above
        if at_u == then:
            lines_u, at_u = lines_u - 1, at_u + apart_u if lines_u > 1 else np.inf
        if at_v == then:
            lines_v, at_v = lines_v - 1, at_v + apart_v if lines_v > 1 else np.inf
        if at_w == then:
            lines_w, at_w = lines_w - 1, at_w + apart_w if lines_w > 1 else np.inf
    return np.inf


@kernel
def _lines(start: float, rate: float, begin: float, first: int, last: int) -> Any:
    """Of the lines at whole numbers first..last: how many a coordinate start + t rate crosses
    after t = begin, at which t the first one, and how far apart in t they are."""
    if rate == 0.0:
        return 0, np.inf, np.inf
    here = start + begin * rate
    line = max(math.floor(here) + 1.0, first) if rate > 0.0 else min(math.ceil(here) - 1.0, last)
    count = int(last - line + 1 if rate > 0.0 else line - first + 1)
    if count < 1:
        return 0, np.inf, np.inf
    return count, max((line - start) / rate, begin), abs(1.0 / rate)


@kernel_using(ground_at)
def _height(heights: Any, u: float, v: float) -> Any:
    """Of the ground, m."""
    return ground_at(heights, 1.0, (0.0, 0.0), u, v)[0]
