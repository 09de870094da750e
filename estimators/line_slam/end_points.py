"""How far each line of the map reaches: bookkeeping beside the filter, no states (SPEC 2.2)."""

import math

import numpy as np
from numpy.typing import NDArray

from grouser.geometry import Array
from grouser.kernels import kernel

_BIAS = 1.0
"""An end counts as so many of its sigmas inside: the farthest of many noisy ends is too far."""

_SAME_END = 3.0
"""sigmas within which an end is the one that is known."""


class EndPoints:
    """Of n lines, in the order of the filter's."""

    def __init__(self) -> None:
        self.extents = np.zeros((0, 2))
        """(n, 2) first and last known place along the tangent, m."""
        self.open_ends = np.zeros((0, 2), dtype=np.bool_)
        """(n, 2) whether the line may go on beyond: there it was hidden, or out of range."""

    def __len__(self) -> int:
        return len(self.extents)

    def add(self, line: Array, ends: Array, sigmas: Array, open_ends: NDArray[np.bool_]) -> None:
        """A new last line (2,), seen between `ends` (2, 2) in the world, which are known along it
        to `sigmas` (2,)."""
        places, order = _in_order(line, ends)
        self.extents = np.vstack([self.extents, _inside(places, sigmas, order)])
        self.open_ends = np.vstack([self.open_ends, open_ends[list(order)]])

    def extend(
        self,
        which: NDArray[np.intp],
        lines: Array,
        ends: Array,
        sigmas: Array,
        open_ends: NDArray[np.bool_],
    ) -> None:
        """Lines were seen again: the k at `which`, of all (n, 2) as they are now, between `ends`
        (k, 2, 2) in the world, `sigmas` and `open_ends` (k, 2)."""
        _extend(self.extents, self.open_ends, which, lines, ends, sigmas, open_ends)

    def join(self, kept: int, gone: int, lines: Array) -> None:
        """Two lines of (n, 2) are one: `gone` is forgotten, `kept` reaches as far as both."""
        places = self.extents[gone]
        opened = self.open_ends[gone]
        if np.cos(lines[kept, 1] - lines[gone, 1]) < 0:
            places, opened = -places[::-1], opened[::-1]
        for side, outward in ((0, -1.0), (1, 1.0)):
            if outward * (places[side] - self.extents[kept, side]) > 0:
                self.extents[kept, side] = places[side]
                self.open_ends[kept, side] = opened[side]
        self.forget(gone)

    def forget(self, index: int) -> None:
        """Those behind it move up."""
        self.extents = np.delete(self.extents, index, axis=0)
        self.open_ends = np.delete(self.open_ends, index, axis=0)

    def beside(
        self,
        lines: Array,
        pose: Array,
        pose_covariance: Array,
        ends: Array,
        *,
        slack: float,
        open_slack: float,
        sigmas: float,
    ) -> NDArray[np.bool_]:
        """(m, n) whether what was seen between `ends` (m, 2, 2), from a pose (3,) with its
        covariance (3, 3), lies beside the known part of each of the lines (n, 2), stretched by
        `slack` [m], or by `open_slack` where it may go on, and by so many sigmas of where along
        the line it is: by the position, and by the heading at its distance."""
        return np.asarray(
            _beside(
                lines,
                pose,
                pose_covariance,
                ends,
                self.extents,
                self.open_ends,
                slack,
                open_slack,
                sigmas,
            )
        )


@kernel
def _beside(
    lines: Array,
    pose: Array,
    C: Array,
    ends: Array,
    extents: Array,
    open_ends: NDArray[np.bool_],
    slack: float,
    open_slack: float,
    sigmas: float,
) -> NDArray[np.bool_]:
    m, n = len(ends), len(lines)
    cosine, sine = math.cos(pose[2]), math.sin(pose[2])
    turned = np.empty((m, 2, 2))
    for i in range(m):
        for side in range(2):
            x, y = ends[i, side]
            turned[i, side] = cosine * x - sine * y, sine * x + cosine * y
    out = np.empty((m, n), dtype=np.bool_)
    for j in range(n):
        c, s = math.cos(lines[j, 1]), math.sin(lines[j, 1])
        along = -s * pose[0] + c * pose[1]
        by_position = s * s * C[0, 0] - 2 * s * c * C[0, 1] + c * c * C[1, 1]
        low = extents[j, 0] - (open_slack if open_ends[j, 0] else slack)
        high = extents[j, 1] + (open_slack if open_ends[j, 1] else slack)
        for i in range(m):
            p, q = turned[i]
            first, last = along - s * p[0] + c * p[1], along - s * q[0] + c * q[1]
            across = 0.5 * (c * (p[0] + q[0]) + s * (p[1] + q[1]))
            unsure = sigmas * math.sqrt(by_position + C[2, 2] * across * across)
            out[i, j] = min(first, last) <= high + unsure and max(first, last) >= low - unsure
    return out


@kernel
def _extend(
    extents: Array,
    known_open: NDArray[np.bool_],
    which: NDArray[np.intp],
    lines: Array,
    ends: Array,
    sigmas: Array,
    open_ends: NDArray[np.bool_],
) -> None:
    for k in range(len(which)):
        line = which[k]
        places, order = _in_order(lines[line], ends[k])
        inside = _inside(places, sigmas[k], order)
        for side in range(2):
            outward = 1.0 if side == 1 else -1.0
            opened, sigma = open_ends[k, order[side]], sigmas[k, order[side]]
            if outward * (inside[side] - extents[line, side]) > 0:
                extents[line, side], known_open[line, side] = inside[side], opened
            elif abs(places[side] - extents[line, side]) < _SAME_END * sigma and not opened:
                known_open[line, side] = False


@kernel
def _in_order(line: Array, ends: Array) -> tuple[tuple[float, float], tuple[int, int]]:
    """Places along the line of two ends (2, 2), ascending, and which end each is."""
    c, s = math.cos(line[1]), math.sin(line[1])
    first, last = -s * ends[0, 0] + c * ends[0, 1], -s * ends[1, 0] + c * ends[1, 1]
    return ((last, first), (1, 0)) if first > last else ((first, last), (0, 1))


@kernel
def _inside(
    places: tuple[float, float], sigmas: Array, order: tuple[int, int]
) -> tuple[float, float]:
    low, high = places[0] + _BIAS * sigmas[order[0]], places[1] - _BIAS * sigmas[order[1]]
    return (low, high) if low < high else ((low + high) / 2, (low + high) / 2)
