"""Scans that are kept, and what others are laid over: those of a stretch of the way."""

from bisect import bisect_left, bisect_right

import numpy as np
from numpy.typing import NDArray

from grouser.estimators.scan_matching.reference import Reference, make_reference
from grouser.estimators.scan_matching.surface import Surface
from grouser.geometry import Array, between


class Keyframes:
    """Scans, one a pose of the graph, in its order."""

    def __init__(self) -> None:
        self.surfaces: list[Surface] = []
        self._laid: list[Surface] = []
        self.way: list[float] = []
        """m driven up to each"""

    def __len__(self) -> int:
        return len(self.surfaces)

    def append(self, surface: Surface, step: float) -> None:
        """The next one, `step` m on."""
        self.way.append((self.way[-1] if self.way else 0.0) + step)
        self.surfaces.append(surface)
        self._laid.append(_thinned(surface))

    def last(self, most: int, way: float) -> NDArray[np.intp]:
        """The latest: `most` of them at most, and no more than `way` m back."""
        first = bisect_left(self.way, self.way[-1] - way)
        return np.arange(max(first, len(self) - most), len(self))

    def before(self, way: float) -> int:
        """How many lie at least so many metres back."""
        return bisect_right(self.way, self.way[-1] - way)

    def around(self, k: int, way: float, n: int) -> NDArray[np.intp]:
        """Those of the first n that lie up to `way` m before and after k."""
        first = bisect_left(self.way, self.way[k] - way)
        return np.arange(first, min(bisect_left(self.way, self.way[k] + way), n))

    def reference(self, which: NDArray[np.intp], poses: Array, frame: Array) -> Reference:
        """Those laid together at their poses (n, 3), in the frame of a pose (3,)."""
        return make_reference([self._laid[i] for i in which], between(frame, poses[which]))


_POINTS = 180
"""Of a scan that others are laid over, at most: many scans fill the gaps."""


def _thinned(surface: Surface) -> Surface:
    few = slice(None, None, -(-max(len(surface.points), 1) // _POINTS))
    return surface._replace(
        points=surface.points[few].copy(),
        feet=surface.feet[few].copy(),
        normals=surface.normals[few].copy(),
        normal_sigmas=surface.normal_sigmas[few].copy(),
    )
