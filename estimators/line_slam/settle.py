"""Which beam at a corner belongs to which wall.

The return that was farthest from a chord is not always the last one of its wall, and one of the
wrong wall turns a line by more than its covariance says.
"""

import numpy as np
from numpy.typing import NDArray

from grouser.estimators.line_slam.line_fit import squared_sigmas_off
from grouser.estimators.line_slam.merge import Fits
from grouser.estimators.line_slam.returns import Returns
from grouser.kernels import kernel, kernel_using

_FAR = 25.0
"""Squared sigmas: a return that is farther from both lines is of neither, and has no say."""
_LOOSE = 4
"""Returns at a corner that the split left to neither piece, at most."""


@kernel_using(squared_sigmas_off)
def settle_corners(
    returns: Returns, breaks: NDArray[np.bool_], fits: Fits, stray: NDArray[np.bool_]
) -> NDArray[np.intp]:
    """(k, 2) the pieces of k lines, each corner moved to where both its lines fit best.

    Args:
        breaks: (m,) whether the surface breaks after each return.
        stray: (m,) which returns are of no line; those between two pieces that meet no longer are,
            in place.
    """
    m, n = len(breaks), len(fits.pieces)
    pieces = fits.pieces.copy()
    for a in range(n if n > 1 else 0):
        b = (a + 1) % n
        last, corner = pieces[a, 1], _after(pieces[b, 0], pieces[a, 1], m)
        if corner - last - 1 > _LOOSE or _broken(breaks, last, corner):
            continue
        for i in range(last + 1, corner):
            stray[i % m] = False
        end = corner + pieces[b, 1] - pieces[b, 0] + 1
        best = _corner(returns, fits, a, b, pieces[a, 0], end)
        pieces[a, 1] = best - 1
        pieces[b, 0], pieces[b, 1] = best % m, best % m + (end - 1 - best)
    return pieces


@kernel
def _after(i: int, before: int, m: int) -> int:
    """The first count of return i that comes after another count."""
    while i <= before:
        i += m
    return i


@kernel
def _broken(breaks: NDArray[np.bool_], first: int, last: int) -> bool:
    """Whether the surface breaks between two returns."""
    for i in range(first, last):
        if breaks[i % len(breaks)]:
            return True
    return False


@kernel_using(squared_sigmas_off)
def _corner(returns: Returns, fits: Fits, a: int, b: int, first: int, end: int) -> int:
    """The first return of line b, of those from `first` to before `end`, which begin with a's."""
    cost, least, best = 0.0, np.inf, first + 2
    for i in range(first, end - 1):
        # What it costs to give the returns before i to line a instead of b.
        if i >= first + 2 and cost < least:
            least, best = cost, i
        cost += _off(returns, i % len(returns.beams), fits, a)
        cost -= _off(returns, i % len(returns.beams), fits, b)
    return best


@kernel_using(squared_sigmas_off)
def _off(returns: Returns, i: int, fits: Fits, k: int) -> float:
    point, by_range, by_bearing = returns.points[i], returns.by_range[i], returns.by_bearing[i]
    off = squared_sigmas_off(point, by_range, by_bearing, fits.lines[k, 0], fits.lines[k, 1])
    return float(min(off, _FAR))
