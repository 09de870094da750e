"""Which of many points is nearest, looked up in a grid that exists only around the points."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from grouser.geometry import Array
from grouser.kernels import kernel

_TILE = 8
"""Cells along a side of a tile."""


class NearestField(NamedTuple):
    """A grid of square cells in tiles; only tiles that a point is near exist."""

    low: Array
    """(2,) corner of the first tile, m"""
    cell: float
    """m"""
    table: NDArray[np.int32]
    """(rows, columns) which tile lies there; -1 where there is none"""
    squared: NDArray[np.float32]
    """(tiles, _TILE, _TILE) squared distance of a cell's centre to the nearest point, m^2; inf
    where none is within reach"""
    nearest: NDArray[np.int32]
    """(tiles, _TILE, _TILE) which point that is; -1 where there is none"""


def nearest_field(points: Array, reach: float, cell: float) -> NearestField:
    """The field of points (n, 2) [m] that are looked for within `reach` [m]."""
    low, high = _bounds(points)
    low, high = low - reach - cell, high + reach + cell
    side = _TILE * cell
    size = np.floor((high - low) / side).astype(int) + 1
    table = np.full((size[0], size[1]), -1, dtype=np.int32)
    tiles = _allot(points, low, side, reach, table)
    squared = np.full((tiles, _TILE, _TILE), np.inf, dtype=np.float32)
    nearest = np.full((tiles, _TILE, _TILE), -1, dtype=np.int32)
    _fill(points, low, cell, reach, table, squared, nearest)
    return NearestField(low, cell, table, squared, nearest)


@kernel
def _bounds(points: Array) -> tuple[Array, Array]:
    """(2,) least and largest coordinates; zero without points."""
    low = points[0].copy() if len(points) else np.zeros(2)
    high = low.copy()
    for k in range(len(points)):
        for axis in range(2):
            low[axis] = min(low[axis], points[k, axis])
            high[axis] = max(high[axis], points[k, axis])
    return low, high


@kernel
def _allot(points: Array, low: Array, side: float, reach: float, table: NDArray[np.int32]) -> int:
    """Number the tiles that a point's reach touches."""
    tiles = 0
    for k in range(len(points)):
        for i in range(
            int((points[k, 0] - reach - low[0]) / side),
            int((points[k, 0] + reach - low[0]) / side) + 1,
        ):
            for j in range(
                int((points[k, 1] - reach - low[1]) / side),
                int((points[k, 1] + reach - low[1]) / side) + 1,
            ):
                if table[i, j] < 0:
                    table[i, j] = tiles
                    tiles += 1
    return tiles


@kernel
def _fill(
    points: Array,
    low: Array,
    cell: float,
    reach: float,
    table: NDArray[np.int32],
    squared: NDArray[np.float32],
    nearest: NDArray[np.int32],
) -> None:
    side, cells = _TILE * cell, _TILE * _TILE
    us, vs = np.empty(cells, dtype=np.float32), np.empty(cells, dtype=np.float32)
    for c in range(cells):
        us[c], vs[c] = (c // _TILE + 0.5) * cell, (c % _TILE + 0.5) * cell
    distances, points_there = squared.reshape(-1, cells), nearest.reshape(-1, cells)
    for k in range(len(points)):
        x, y = points[k, 0] - low[0], points[k, 1] - low[1]
        for i in range(int((x - reach) / side), int((x + reach) / side) + 1):
            u = np.float32(x - i * side)
            for j in range(int((y - reach) / side), int((y + reach) / side) + 1):
                tile, v = table[i, j], np.float32(y - j * side)
                _lower(us, vs, u, v, np.int32(k), distances[tile], points_there[tile])
    farthest = np.float32(reach * reach)
    for tile in range(len(distances)):
        for c in range(cells):
            if distances[tile, c] > farthest:
                distances[tile, c], points_there[tile, c] = np.inf, -1


@kernel
def _lower(
    us: NDArray[np.float32],
    vs: NDArray[np.float32],
    u: float,
    v: float,
    k: int,
    squared: NDArray[np.float32],
    nearest: NDArray[np.int32],
) -> None:
    """Point k at (u, v) becomes the nearest of those cells of a tile, at (us, vs), whose it is.

    Without a branch and over a length that the compiler does not know, so that it takes many cells
    at once: all of a tile take a third of the time of those within reach one by one.
    """
    for c in range(len(squared)):
        du, dv = us[c] - u, vs[c] - v
        d2 = du * du + dv * dv
        before, who = squared[c], nearest[c]
        nearer = d2 < before
        squared[c] = d2 if nearer else before
        nearest[c] = k if nearer else who


@kernel
def tile_at(field: NearestField, x: float, y: float) -> tuple[int, int, int]:
    """The tile that (x, y) lies in, -1 where there is none, and the cell in it."""
    u, v = (x - field.low[0]) / field.cell, (y - field.low[1]) / field.cell
    if not (u >= 0.0 and v >= 0.0):
        return -1, 0, 0
    i, j = int(u), int(v)
    if i // _TILE >= field.table.shape[0] or j // _TILE >= field.table.shape[1]:
        return -1, 0, 0
    return field.table[i // _TILE, j // _TILE], i % _TILE, j % _TILE


@kernel
def nearest_to(field: NearestField, x: float, y: float) -> int:
    """The point nearest to the centre of the cell at (x, y); -1 where none is within reach."""
    tile, i, j = tile_at(field, x, y)
    return field.nearest[tile, i, j] if tile >= 0 else -1
