"""Where the lines of one surface meet: SPEC 2.5, step 2.

The iterative end-point fit: a run of returns is split where one is farthest from the chord of its
ends, in tolerances, while that is more than one.
"""

import math

import numpy as np
from numpy.typing import NDArray

from grouser.estimators.line_slam.returns import Returns
from grouser.geometry import Array
from grouser.kernels import kernel


@kernel
def runs_between(breaks: NDArray[np.bool_]) -> NDArray[np.intp]:
    """(k, 2) the first and the last return of each unbroken run; the first return begins one."""
    runs = np.empty((len(breaks), 2), dtype=np.intp)
    k, first = 0, 0
    for i in range(len(breaks)):
        if breaks[i] or i == len(breaks) - 1:
            runs[k, 0], runs[k, 1] = first, i
            k, first = k + 1, i + 1
    return runs[:k]


@kernel
def split_at_corners(
    returns: Returns, runs: NDArray[np.intp], tolerance: float, floor: float
) -> NDArray[np.intp]:
    """(k, 2) the first and the last return of each piece, in order, none of them twice.

    Args:
        runs: (n, 2) first and last return of each run.
        tolerance: how far a return may be from a chord, in sigmas; `floor`: and so many m beside.
    """
    m = len(returns.points)
    pieces = np.empty((m, 2), dtype=np.intp)
    waiting = np.empty((m + 1, 2), dtype=np.intp)
    tolerances = np.empty(m)
    for i in range(m):
        by_range, by_bearing = returns.by_range[i], returns.by_bearing[i]
        variance = (by_range * by_range).sum() + (by_bearing * by_bearing).sum()
        tolerances[i] = tolerance * math.sqrt(variance) + floor
    k = 0
    for run in range(len(runs)):
        waiting[0] = runs[run]
        n = 1
        while n > 0:
            n -= 1
            first, last = waiting[n, 0], waiting[n, 1]
            corner = _corner(returns.points, tolerances, first, last)
            if corner < 0:
                pieces[k, 0], pieces[k, 1] = first, last
                k += 1
            else:  # the one that comes first is taken up first
                waiting[n, 0], waiting[n, 1] = corner, last
                waiting[n + 1, 0], waiting[n + 1, 1] = first, corner - 1
                n += 2
    return pieces[:k]


@kernel
def _corner(points: Array, tolerances: Array, first: int, last: int) -> int:
    """The return that is farthest from the chord, not the first; -1 where all are close to it."""
    dx, dy = points[last, 0] - points[first, 0], points[last, 1] - points[first, 1]
    length = math.hypot(dx, dy)
    worst, corner = 1.0, -1
    for i in range(first + 1, last):
        x, y = points[i, 0] - points[first, 0], points[i, 1] - points[first, 1]
        off = abs(dx * y - dy * x) / length if length > 0 else math.hypot(x, y)
        if off > worst * tolerances[i]:
            worst, corner = off / tolerances[i], i
    return corner
