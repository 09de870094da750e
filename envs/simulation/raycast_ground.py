"""Where rays first meet the ground: a march from line to line of its grid of triangles, exact.

Along a ray the ground's height is linear between the grid's lines and the diagonals of its cells
(Amanatides and Woo, Eurographics 1987, with a third family of lines).
"""

import math
from typing import Any

import numpy as np

from grouser.envs.simulation.ground import ground_at
from grouser.kernels import kernel, kernel_using

_MARGIN = 0.01
"""Above the highest ground a march begins, m: on it, rounding could take it for below."""


@kernel_using(ground_at)
def meet_ground(
    origins: Any, directions: Any, heights: Any, cell: float, grid_origin: Any, distance: Any
) -> None:
    """Shorten distances (n,) along unit directions (n, 3) to where rays come down on the ground."""
    lowest, highest = heights.min(), heights.max()
    several = origins.shape[0] > 1
    for i in range(directions.shape[0]):
        o, d = origins[i if several else 0], directions[i]
        if lowest == highest:
            distance[i] = _come_down(o[2] - lowest, d[2], distance[i])
        else:
            begin, end = _below(highest + _MARGIN, o[2], d[2], distance[i])
            if begin < end:
                met = _march(o, d, begin, end, heights, cell, grid_origin)
                distance[i] = min(distance[i], met)


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
def _march(
    o: Any, d: Any, begin: float, end: float, heights: Any, cell: float, grid_origin: Any
) -> Any:
    """Where a ray comes from above to below the ground within (begin, end]; infinity if nowhere."""
    rows, columns = heights.shape[0] - 1, heights.shape[1] - 1
    u, v = (o[0] - grid_origin[0]) / cell, (o[1] - grid_origin[1]) / cell
    du, dv = d[0] / cell, d[1] / cell
    line_u, at_u, apart_u = _first_line(u, du, begin, 0, columns)
    line_v, at_v, apart_v = _first_line(v, dv, begin, 0, rows)
    line_w, at_w, apart_w = _first_line(u - v, du - dv, begin, -rows, columns)
    t, above = begin, _height_above(o, d, begin, heights, cell, grid_origin)
    while t < end:
        then = min(at_u, at_v, at_w, end)
        then_above = _height_above(o, d, then, heights, cell, grid_origin)
        if then_above <= 0.0 < above:
            return t + (then - t) * above / (above - then_above)
        t, above = then, then_above
        if at_u == then:
            line_u, at_u = line_u - 1, at_u + apart_u if line_u > 1 else np.inf
        if at_v == then:
            line_v, at_v = line_v - 1, at_v + apart_v if line_v > 1 else np.inf
        if at_w == then:
            line_w, at_w = line_w - 1, at_w + apart_w if line_w > 1 else np.inf
    return np.inf


@kernel
def _first_line(start: float, rate: float, begin: float, first: int, last: int) -> Any:
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
def _height_above(o: Any, d: Any, t: float, heights: Any, cell: float, grid_origin: Any) -> Any:
    """How far above the ground a ray is."""
    x, y = o[0] + t * d[0], o[1] + t * d[1]
    return o[2] + t * d[2] - ground_at(heights, cell, grid_origin, x, y)[0]
