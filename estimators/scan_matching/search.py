"""Correlative search: of all poses around a guess, that from which a scan fits best (Olson,
"Real-time correlative scan matching", ICRA 2009), in two steps from coarse to fine."""

from dataclasses import dataclass
from math import radians

import numpy as np
from numpy.typing import NDArray

from grouser.checks import require_not_negative, require_positive
from grouser.estimators.scan_matching.nearest_field import NearestField, tile_at
from grouser.geometry import Array, wrap
from grouser.kernels import kernel, kernel_using


@dataclass(frozen=True, slots=True)
class SearchOptions:
    """How far around the guess is searched, and how closely (SPEC 2.6)."""

    position: float = 0.4
    """m to either side, along both axes"""
    heading: float = radians(14.0)
    """rad to either side"""
    coarse_position: float = 0.1
    """Between the poses tried first, m,"""
    coarse_heading: float = radians(1.0)
    """rad;"""
    fine_position: float = 0.05
    """and then around the best of them, m,"""
    fine_heading: float = radians(0.5)
    """rad."""
    sigma: float = 0.08
    """m of distance at which a point counts exp(-1/2)"""
    points: int = 180
    """Points of a scan that are used, at most, evenly spread over it"""
    weight: float = 0.25
    """Log-likelihood that a point adds where it fits, against the prior's"""

    def __post_init__(self) -> None:
        require_positive(
            self, "coarse_position", "coarse_heading", "fine_position", "fine_heading", "sigma"
        )
        require_not_negative(self, "position", "heading", "weight")
        require_positive(self, "points")


def search(
    points: Array, field: NearestField, guess: Array, information: Array, options: SearchOptions
) -> Array:
    """The pose (3,), near the guess (3,), that most of the points (n, 2) fit from.

    Args:
        information: (3, 3) inverse covariance of the guess.
    """
    few = points[:: -(-len(points) // options.points)] if len(points) else points
    fits = _fits(field, options.sigma)
    best = guess
    for reach, step in (
        ((options.position, options.heading), (options.coarse_position, options.coarse_heading)),
        (
            (options.coarse_position, options.coarse_heading),
            (options.fine_position, options.fine_heading),
        ),
    ):
        counts = [int(np.floor(r / s + 1e-9)) for r, s in zip(reach, step, strict=True)]
        best = _best(
            few,
            field,
            fits,
            best,
            guess,
            information,
            counts[0],
            step[0],
            counts[1],
            step[1],
            options.weight,
        )
    best[2] = wrap(best[2])
    return best


def score(points: Array, field: NearestField, pose: Array, sigma: float) -> float:
    """Mean over the points (n, 2), from a pose (3,), of exp(-d^2 / 2 sigma^2), d to the nearest
    point of the field [m]; 0 without points."""
    return float(_likelihood(points, field, pose, sigma)) / max(len(points), 1)


def value(
    points: Array,
    field: NearestField,
    pose: Array,
    guess: Array,
    information: Array,
    options: SearchOptions,
) -> float:
    """What the search makes most of: the log-likelihood of a pose (3,), but for a constant."""
    off = pose - guess
    off[2] = wrap(off[2])
    fit = options.weight * min(len(points), options.points)
    fit *= score(points, field, pose, options.sigma)
    return float(fit - 0.5 * off @ information @ off)


def _fits(field: NearestField, sigma: float) -> NDArray[np.float32]:
    """How well a point fits that lies in each cell."""
    return np.asarray(np.exp(field.squared * np.float32(-0.5 / sigma**2)))


@kernel_using(tile_at)
def _likelihood(points: Array, field: NearestField, pose: Array, sigma: float) -> float:
    """The same as `_sum`, for one pose."""
    c, s = np.cos(pose[2]), np.sin(pose[2])
    total = 0.0
    for k in range(len(points)):
        x = pose[0] + c * points[k, 0] - s * points[k, 1]
        y = pose[1] + s * points[k, 0] + c * points[k, 1]
        tile, i, j = tile_at(field, x, y)
        if tile >= 0:
            total += np.exp(-0.5 * field.squared[tile, i, j] / (sigma * sigma))
    return total


@kernel_using(tile_at)
def _best(
    points: Array,
    field: NearestField,
    fits: NDArray[np.float32],
    centre: Array,
    guess: Array,
    information: Array,
    n: int,
    step: float,
    n_turns: int,
    turn: float,
    weight: float,
) -> Array:
    """A pose is given up as soon as it cannot become the best, if all points that are left fitted:
    most are after a few."""
    best, highest = centre.copy(), -np.inf
    order = _spread(len(points))
    turned = np.empty((len(points), 2))
    pose, off = np.empty(3), np.empty(3)
    for k in _from_the_middle(n_turns):
        pose[2] = centre[2] + k * turn
        c, s = np.cos(pose[2]), np.sin(pose[2])
        for p in range(len(points)):
            x, y = points[order[p], 0], points[order[p], 1]
            turned[p, 0], turned[p, 1] = c * x - s * y, s * x + c * y
        for i in _from_the_middle(n):
            pose[0] = centre[0] + i * step
            for j in _from_the_middle(n):
                pose[1] = centre[1] + j * step
                for axis in range(3):
                    off[axis] = pose[axis] - guess[axis]
                prior = -0.5 * _squared(off, information)
                least = (highest - prior) / weight if weight > 0.0 else -np.inf
                value = prior + weight * _sum(turned, field, fits, pose, least)
                if value > highest:
                    highest = value
                    best[:] = pose
    return best


@kernel_using(tile_at)
def _sum(
    turned: Array, field: NearestField, fits: NDArray[np.float32], pose: Array, least: float
) -> float:
    """How many points fit, each as well as its cell says; or less than `least`, if that is sure."""
    total, n = 0.0, len(turned)
    for first in range(0, n, _AT_ONCE):
        if total + (n - first) < least:
            break
        for p in range(first, min(first + _AT_ONCE, n)):
            tile, i, j = tile_at(field, pose[0] + turned[p, 0], pose[1] + turned[p, 1])
            if tile >= 0:
                total += fits[tile, i, j]
    return total


@kernel
def _spread(n: int) -> NDArray[np.intp]:
    """The numbers below n, so that the first few are from everywhere."""
    out, at = np.empty(n, dtype=np.intp), 0
    for first in range(_STRIDE):
        for k in range(first, n, _STRIDE):
            out[at] = k
            at += 1
    return out


@kernel
def _from_the_middle(n: int) -> NDArray[np.intp]:
    """0, -1, 1, -2, ... n: what is likely comes first."""
    out = np.zeros(2 * n + 1, dtype=np.intp)
    for k in range(1, n + 1):
        out[2 * k - 1], out[2 * k] = -k, k
    return out


@kernel
def _squared(off: Array, information: Array) -> float:
    """off^T information off"""
    total = 0.0
    for a in range(3):
        for b in range(3):
            total += off[a] * information[a, b] * off[b]
    return total


_AT_ONCE = 12
"""Points between two looks at whether it is worth to go on"""
_STRIDE = 15
