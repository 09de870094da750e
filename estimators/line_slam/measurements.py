"""What a filter is told of the lines that were seen, whatever saw them."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from grouser.geometry import Array


@dataclass(frozen=True, slots=True, eq=False)
class LineMeasurements:
    """n lines in the robot's frame, in the order in which they lie around it."""

    lines: Array
    """(n, 2) r [m], alpha [rad] as in `lines.py`, the normal away from the robot (r >= 0)."""
    covariances: Array
    """(n, 2, 2) of r and alpha."""
    ends: Array
    """(n, 2, 2) the seen part's first and last point along the tangent, x and y [m]."""
    end_sigmas: Array
    """(n, 2) how well their places along the tangent are known, m."""
    open_ends: NDArray[np.bool_]
    """(n, 2) whether the line may go on beyond that end: it was hidden, or out of range there."""

    def __len__(self) -> int:
        """How many lines."""
        return len(self.lines)

    def __getitem__(self, chosen: "NDArray[np.bool_] | NDArray[np.intp]") -> "LineMeasurements":
        """The chosen lines, by mask or by index."""
        return LineMeasurements(
            self.lines[chosen],
            self.covariances[chosen],
            self.ends[chosen],
            self.end_sigmas[chosen],
            self.open_ends[chosen],
        )


def no_lines() -> LineMeasurements:
    """Nothing seen."""
    return LineMeasurements(
        np.zeros((0, 2)),
        np.zeros((0, 2, 2)),
        np.zeros((0, 2, 2)),
        np.zeros((0, 2)),
        np.zeros((0, 2), dtype=np.bool_),
    )
