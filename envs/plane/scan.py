"""Rays on a plane against line segments: the nearest one hides what is behind it."""

import math
from typing import Any

import numpy as np

from grouser.geometry import Array
from grouser.kernels import kernel


def cast(segments: Array, position: Array, directions: Array, reach: float) -> Array:
    """(m,) how far rays go until they meet a segment, m; infinity where none is within reach.

    Args:
        segments: (n, 4) x and y of both ends, m.
        position: (2,) where all rays begin, m.
        directions: (m,) rad.
        reach: m
    """
    ranges = np.empty(len(directions))
    _cast(segments, position[0], position[1], directions, reach, ranges)
    return ranges


@kernel
def _cast(segments: Any, gx: float, gy: float, directions: Any, reach: float, out: Any) -> None:
    for k in range(directions.size):
        c, s = math.cos(directions[k]), math.sin(directions[k])
        nearest = math.inf
        for i in range(segments.shape[0]):
            ax, ay = segments[i, 0] - gx, segments[i, 1] - gy
            bx, by = segments[i, 2] - gx, segments[i, 3] - gy
            # How far the ends are to the left of the ray; one of them must be, the other not.
            left_a, left_b = c * ay - s * ax, c * by - s * bx
            if (left_a > 0.0) == (left_b > 0.0):
                continue
            t = left_a / (left_a - left_b)
            along = (1.0 - t) * (c * ax + s * ay) + t * (c * bx + s * by)
            if 0.0 <= along < nearest:
                nearest = along
        out[k] = nearest if nearest <= reach else math.inf
