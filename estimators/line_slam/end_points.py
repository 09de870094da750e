"""How far each line of the map reaches: bookkeeping beside the filter, no states (SPEC 2.2)."""

import numpy as np
from numpy.typing import NDArray

from grouser.estimators.line_slam.lines import places_along
from grouser.geometry import Array

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
        places, sigmas, open_ends = _in_order(line, ends, sigmas, open_ends)
        self.extents = np.vstack([self.extents, _inside(places, sigmas)])
        self.open_ends = np.vstack([self.open_ends, open_ends])

    def extend(
        self, index: int, line: Array, ends: Array, sigmas: Array, open_ends: NDArray[np.bool_]
    ) -> None:
        """The line at `index`, now at (r, alpha) `line`, was seen again."""
        places, sigmas, open_ends = _in_order(line, ends, sigmas, open_ends)
        inside, known, opened = _inside(places, sigmas), self.extents[index], self.open_ends[index]
        for side, outward in ((0, -1.0), (1, 1.0)):
            ahead = outward * (inside[side] - known[side])
            if ahead > 0:
                known[side], opened[side] = inside[side], open_ends[side]
            elif abs(places[side] - known[side]) < _SAME_END * sigmas[side]:
                opened[side] &= open_ends[side]

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

    def overlaps(
        self, lines: Array, ends: Array, *, slack: float, open_slack: float, unsure: Array
    ) -> NDArray[np.bool_]:
        """(m, n) whether what was seen between `ends` (m, 2, 2) in the world lies beside a line's
        known part, stretched by `slack` [m], or by `open_slack` where it may go on, and by how
        `unsure` (m, n) it is where along the line that was, m."""
        places = np.sort(places_along(lines[None], ends[:, :, None]), axis=1)  # (m, 2, n)
        stretch = np.where(self.open_ends, open_slack, slack)
        low = self.extents[:, 0] - stretch[:, 0] - unsure
        high = self.extents[:, 1] + stretch[:, 1] + unsure
        return np.asarray((places[:, 0] <= high) & (places[:, 1] >= low))


def _in_order(
    line: Array, ends: Array, sigmas: Array, open_ends: NDArray[np.bool_]
) -> tuple[Array, Array, NDArray[np.bool_]]:
    """Places along the line, ascending, and what belongs to each."""
    places = places_along(line, ends)
    if places[0] > places[1]:
        return places[::-1], sigmas[::-1], open_ends[::-1]
    return places, sigmas, open_ends


def _inside(places: Array, sigmas: Array) -> Array:
    low, high = places[0] + _BIAS * sigmas[0], places[1] - _BIAS * sigmas[1]
    return np.array([low, high]) if low < high else np.full(2, (low + high) / 2)
