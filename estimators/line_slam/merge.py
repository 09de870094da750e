"""Pieces of one line become one: SPEC 2.5, step 4."""

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from grouser.estimators.line_slam.break_points import joined
from grouser.estimators.line_slam.line_fit import fit_line
from grouser.estimators.line_slam.returns import Returns, Spacing
from grouser.geometry import Array
from grouser.kernels import kernel, kernel_using


class Fits(NamedTuple):
    """k lines and what they were fitted to, in order."""

    pieces: NDArray[np.intp]
    """(k, 2) first and last return; the count goes on beyond the last of all."""
    lines: Array
    """(k, 2) r [m], alpha [rad]"""
    covariances: Array
    """(k, 2, 2)"""
    chi2: Array
    """(k,)"""
    counts: NDArray[np.intp]
    """(k,) returns"""


@kernel
def largest_chi2(count: Any) -> Any:
    """Of so many returns (a number or an array of them) that lie on a straight line."""
    return count + 4 * np.sqrt(2.0 * count)


@kernel
def strays(m: int, pieces: NDArray[np.intp]) -> NDArray[np.bool_]:
    """(m,) which returns are of no piece of three returns and more."""
    stray = np.ones(m, dtype=np.bool_)
    for k in range(len(pieces)):
        if pieces[k, 1] - pieces[k, 0] >= 2:
            stray[pieces[k, 0] : pieces[k, 1] + 1] = False
    return stray


@kernel_using(fit_line, joined)
def fit_and_merge(
    returns: Returns,
    pieces: NDArray[np.intp],
    stray: NDArray[np.bool_],
    spacing: Spacing,
    gate: float,
) -> Fits:
    """Lines of the pieces (k, 2) that have three returns and more.

    Neighbours are merged while one surface may join them and their difference, squared over its
    covariance, is below the gate: no line leads through a doorway, and a few returns of something
    thin in front of a wall, which are `stray`, do not cut it.
    """
    pieces = pieces[pieces[:, 1] - pieces[:, 0] >= 2]
    fits = _nothing(len(pieces))
    for k in range(len(pieces)):
        _fit(returns, pieces[k], stray, fits, k)

    n, at, unmerged = len(pieces), 0, 0
    while n > 1 and unmerged < n:  # once around since the last merger
        after = (at + 1) % n
        if _merge(returns, stray, fits, at, after, spacing, gate):
            _remove(fits, after, n)
            n, unmerged = n - 1, 0
            at = at - 1 if after < at else at
        else:
            at, unmerged = after, unmerged + 1
    return Fits(
        fits.pieces[:n], fits.lines[:n], fits.covariances[:n], fits.chi2[:n], fits.counts[:n]
    )


@kernel
def _nothing(k: int) -> Fits:
    """Room for k lines."""
    return Fits(
        np.empty((k, 2), dtype=np.intp),
        np.empty((k, 2)),
        np.empty((k, 2, 2)),
        np.empty(k),
        np.empty(k, dtype=np.intp),
    )


@kernel_using(fit_line)
def _fit(
    returns: Returns, piece: NDArray[np.intp], stray: NDArray[np.bool_], fits: Fits, k: int
) -> None:
    """Write the line of a piece (2,), without what something in front of it returned."""
    which = np.empty(piece[1] + 1 - piece[0], dtype=np.intp)
    n = 0
    for i in range(piece[0], piece[1] + 1):
        if not stray[i % len(stray)]:
            which[n] = i % len(stray)
            n += 1
    which = which[:n]
    line, covariance, chi2 = fit_line(
        returns.points[which], returns.by_range[which], returns.by_bearing[which]
    )
    fits.pieces[k], fits.lines[k], fits.covariances[k] = piece, line, covariance
    fits.chi2[k], fits.counts[k] = chi2, n


@kernel_using(joined, _fit)
def _merge(
    returns: Returns,
    stray: NDArray[np.bool_],
    fits: Fits,
    a: int,
    b: int,
    spacing: Spacing,
    gate: float,
) -> bool:
    """Write the line of both to a, where they are one; b is the next after it."""
    m = len(stray)
    if not joined(returns, fits.pieces[a, 1] % m, fits.pieces[b, 0] % m, spacing):
        return False
    if not _same_line(fits, a, b, gate):
        return False
    both = np.array([fits.pieces[a, 0], fits.pieces[b, 1]])
    if both[1] < both[0]:
        both[1] += m
    merged = _nothing(1)
    _fit(returns, both, stray, merged, 0)
    if not merged.chi2[0] < largest_chi2(merged.counts[0]):
        return False
    _fit(returns, both, stray, fits, a)
    return True


@kernel
def _same_line(fits: Fits, a: int, b: int, gate: float) -> bool:
    """Whether the difference of two lines is within what their covariances explain."""
    r, turn = fits.lines[b, 0], fits.lines[b, 1] - fits.lines[a, 1]
    half_turns = math.floor(turn / math.pi + 0.5)
    turn -= half_turns * math.pi
    sign = 1.0 if half_turns % 2 == 0 else -1.0  # the same points in the form (-r, alpha + pi)
    dr = sign * r - fits.lines[a, 0]
    C_a, C_b = fits.covariances[a], fits.covariances[b]
    S00, S11 = C_a[0, 0] + C_b[0, 0], C_a[1, 1] + C_b[1, 1]
    S01 = C_a[0, 1] + sign * C_b[0, 1]
    d2 = (S11 * dr * dr - 2 * S01 * dr * turn + S00 * turn * turn) / (S00 * S11 - S01 * S01)
    return bool(d2 < gate)


@kernel
def _remove(fits: Fits, k: int, n: int) -> None:
    """Forget line k of n; those behind move up."""
    for i in range(k, n - 1):
        fits.pieces[i], fits.lines[i] = fits.pieces[i + 1], fits.lines[i + 1]
        fits.covariances[i] = fits.covariances[i + 1]
        fits.chi2[i], fits.counts[i] = fits.chi2[i + 1], fits.counts[i + 1]
