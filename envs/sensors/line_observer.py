"""Which part of a line a robot sees within its range: paper 2's observer, three ways (SPEC 2.3).

A segment runs from A to B; t in [0, 1] is the point A + t (B - A). The robot stands at G and sees
what is within the range D: F(t) = |A + t (B - A) - G|^2 - D^2 <= 0, always an interval of t.

    bisection       as the paper: where the foot of the perpendicular lies decides which roots of
                    F are sought, and by halving; squares only
    closed-form     the roots of the quadratic, which the paper calls costly: it is the fastest
    point-by-point  the segment taken to pieces, as the paper's predecessors do
"""

import math
from abc import ABC, abstractmethod
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from grouser.checks import did_you_mean
from grouser.geometry import Array
from grouser.kernels import kernel


class LineObserver(ABC):
    """Tells the visible part of segments. It sees through things: there is no occlusion."""

    @abstractmethod
    def observe(self, segments: ArrayLike, position: ArrayLike, reach: float) -> Array:
        """Where the visible part of each segment begins and ends.

        Args:
            segments: (n, 4) x and y of A, x and y of B, m.
            position: (2,) of the robot, m.
            reach: how far it sees, m.

        Returns:
            (n, 2) t of the first and the last visible point; NaN where nothing is visible. A
            segment that is touched in one point has both alike.

        Raises:
            ValueError: an argument of another shape, not finite, or a reach that is not positive.
        """


class BisectionObserver(LineObserver):
    """Paper 2, section 2, Figs. 3 and 4, to a tolerance in metres; errs to the inner side only."""

    def __init__(self, *, tolerance: float = 1e-3) -> None:
        """tolerance: m; raises ValueError where it is not positive."""
        self.tolerance = _positive("tolerance", tolerance)

    def observe(self, segments: ArrayLike, position: ArrayLike, reach: float) -> Array:
        A_B, G, D = _checked(segments, position, reach)
        seen = np.empty((len(A_B), 2))
        _bisect_all(A_B, G[0], G[1], D, self.tolerance, seen)
        return seen


class ClosedFormObserver(LineObserver):
    """tf -+ sqrt(D^2 - h^2) / |AB|, h the distance of the line and tf the foot's t."""

    def observe(self, segments: ArrayLike, position: ArrayLike, reach: float) -> Array:
        A_B, G, D = _checked(segments, position, reach)
        seen = np.empty((len(A_B), 2))
        _solve_all(A_B, G[0], G[1], D, seen)
        return seen


class PointByPointObserver(LineObserver):
    """Looks at points along the segment, from end to end; what lies between them it cannot see."""

    def __init__(self, *, spacing: float = 0.1) -> None:
        """spacing: m between the points, at most; raises ValueError where it is not positive."""
        self.spacing = _positive("spacing", spacing)

    def observe(self, segments: ArrayLike, position: ArrayLike, reach: float) -> Array:
        A_B, G, D = _checked(segments, position, reach)
        seen = np.empty((len(A_B), 2))
        _walk_all(A_B, G[0], G[1], D, self.spacing, seen)
        return seen


OBSERVERS: dict[str, type[LineObserver]] = {
    "bisection": BisectionObserver,
    "closed-form": ClosedFormObserver,
    "point-by-point": PointByPointObserver,
}
"""The observers by name."""


def make_line_observer(name: str, **options: float) -> LineObserver:
    """An observer by its name, with its options.

    Raises:
        ValueError: an unknown name, or an option out of range.
        TypeError: an option that the observer does not have.
    """
    if name not in OBSERVERS:
        hint = did_you_mean(name, OBSERVERS)
        raise ValueError(
            f"no line observer is named {name!r}; {hint}known: {', '.join(sorted(OBSERVERS))}"
        )
    return OBSERVERS[name](**options)


def _positive(name: str, value: float) -> float:
    if not (math.isfinite(value) and value > 0):
        raise ValueError(f"{name} must be positive and finite, m, got {value!r}")
    return float(value)


def _checked(
    segments: ArrayLike, position: ArrayLike, reach: float
) -> tuple[Array, tuple[float, float], float]:
    A_B = np.ascontiguousarray(segments, dtype=np.float64)
    G = np.asarray(position, dtype=np.float64)
    if A_B.ndim != 2 or A_B.shape[1] != 4 or not _all_finite(A_B):
        raise ValueError(
            f"segments must be (n, 4) finite numbers: x and y of both ends [m], got shape "
            f"{A_B.shape}"
        )
    if G.shape != (2,) or not (math.isfinite(G[0]) and math.isfinite(G[1])):
        raise ValueError(f"position must be two finite numbers [m], got {position!r}")
    return A_B, (float(G[0]), float(G[1])), _positive("reach", reach)


@kernel
def _all_finite(A_B: Any) -> bool:
    """Of (n, 4) numbers. NumPy, which makes a mask of them first, takes half as long for it as the
    closed form takes for all."""
    for i in range(A_B.shape[0]):
        a, b = A_B[i, 0] - A_B[i, 0], A_B[i, 1] - A_B[i, 1]
        c, d = A_B[i, 2] - A_B[i, 2], A_B[i, 3] - A_B[i, 3]
        if not a + b + c + d == 0.0:  # what is not finite, less itself, is NaN
            return False
    return True


@kernel
def _excess(x: float, y: float, bx: float, by: float, t: float, D2: float) -> float:
    """F(t), with A - G = (x, y) and B - A = (bx, by)."""
    px, py = x + t * bx, y + t * by
    return float(px * px + py * py - D2)


@kernel
def _root(at_a: float, slope: float, length2: float, te: float, inside: float, way: float) -> float:
    """The visible side of where F changes its sign, on a way in t from a visible point to an
    invisible one. With A's own F multiplied out, F(t) = F(0) + t (slope + t |AB|^2), a halving is
    a chain of few operations, each of which waits for the one before."""
    while abs(way) > te:
        way *= 0.5
        middle = inside + way
        if middle == inside:
            break  # they are neighbours among the floats
        inside = middle if at_a + middle * (slope + middle * length2) <= 0.0 else inside
    return inside


@kernel
def _bisect(
    x: float, y: float, bx: float, by: float, D2: float, tolerance: float
) -> tuple[float, float]:
    """SPEC 2.3, all branches in its order."""
    none = (math.nan, math.nan)
    length2 = bx * bx + by * by
    at_a = _excess(x, y, bx, by, 0.0, D2)
    if length2 == 0.0:
        return none if at_a > 0.0 else (0.0, 1.0)
    along = x * bx + y * by
    tf, slope = -along / length2, 2.0 * along
    te = tolerance / math.sqrt(length2)
    at_b = _excess(x, y, bx, by, 1.0, D2)
    if tf <= 0.0:  # Fig. 3: the distance grows from A to B
        if at_a > 0.0:
            return none
        return (0.0, 1.0) if at_b <= 0.0 else (0.0, _root(at_a, slope, length2, te, 0.0, 1.0))
    if tf >= 1.0:  # its mirror
        if at_b > 0.0:
            return none
        return (0.0, 1.0) if at_a <= 0.0 else (_root(at_a, slope, length2, te, 1.0, -1.0), 1.0)
    if _excess(x, y, bx, by, tf, D2) > 0.0:
        return none
    if tf <= 0.5:  # Fig. 4: OB is the longer half
        if at_b <= 0.0:
            return 0.0, 1.0
        end = _root(at_a, slope, length2, te, tf, 1.0 - tf)
        return max(0.0, 2.0 * tf - end), end
    if at_a <= 0.0:
        return 0.0, 1.0
    end = _root(at_a, slope, length2, te, tf, -tf)
    return end, min(1.0, 2.0 * tf - end)


@kernel
def _bisect_all(A_B: Any, gx: float, gy: float, D: float, tolerance: float, seen: Any) -> None:
    for i in range(A_B.shape[0]):
        x, y = A_B[i, 0] - gx, A_B[i, 1] - gy
        bx, by = A_B[i, 2] - A_B[i, 0], A_B[i, 3] - A_B[i, 1]
        seen[i, 0], seen[i, 1] = _bisect(x, y, bx, by, D * D, tolerance)


@kernel
def _solve_all(A_B: Any, gx: float, gy: float, D: float, seen: Any) -> None:
    lanes = np.empty((6, _LANES))
    for start in range(0, A_B.shape[0], _LANES):
        end = min(start + _LANES, A_B.shape[0])
        _solve(A_B[start:end], gx, gy, D * D, lanes, seen[start:end])


@kernel
def _solve(A_B: Any, gx: float, gy: float, D2: float, lanes: Any, seen: Any) -> None:
    """Each coordinate of some segments laid together, and no branches: so the processor takes
    several segments at once."""
    x, y, bx, by, first, last = lanes[0], lanes[1], lanes[2], lanes[3], lanes[4], lanes[5]
    for i in range(A_B.shape[0]):
        x[i], y[i] = A_B[i, 0] - gx, A_B[i, 1] - gy
        bx[i], by[i] = A_B[i, 2] - A_B[i, 0], A_B[i, 3] - A_B[i, 1]
    for i in range(A_B.shape[0]):
        length2 = bx[i] * bx[i] + by[i] * by[i]
        divisor = length2 if length2 > 0.0 else 1.0
        tf = -(x[i] * bx[i] + y[i] * by[i]) / divisor
        below = -_excess(x[i], y[i], bx[i], by[i], tf, D2)  # D^2 - h^2
        half = math.sqrt(abs(below) / divisor) if length2 > 0.0 else 1.0
        low, high = max(0.0, tf - half), min(1.0, tf + half)
        visible = (below >= 0.0) & (low <= high)
        first[i], last[i] = low if visible else math.nan, high if visible else math.nan
    for i in range(A_B.shape[0]):
        seen[i, 0], seen[i, 1] = first[i], last[i]


_LANES = 64
"""Segments that fit into the nearest cache"""


@kernel
def _walk_all(A_B: Any, gx: float, gy: float, D: float, spacing: float, seen: Any) -> None:
    D2 = D * D
    for i in range(A_B.shape[0]):
        x, y = A_B[i, 0] - gx, A_B[i, 1] - gy
        bx, by = A_B[i, 2] - A_B[i, 0], A_B[i, 3] - A_B[i, 1]
        steps = max(1, int(math.ceil(math.sqrt(bx * bx + by * by) / spacing)))
        seen[i, 0], seen[i, 1] = math.nan, math.nan
        for k in range(steps + 1):
            t = k / steps
            if _excess(x, y, bx, by, t, D2) <= 0.0:
                if math.isnan(seen[i, 0]):
                    seen[i, 0] = t
                seen[i, 1] = t
