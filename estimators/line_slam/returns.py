"""What compiled code is told of a scan: its returns with their noise, and how they lie together."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from grouser.estimators.line_slam.scan import Scan
from grouser.geometry import Array


class Returns(NamedTuple):
    """The m beams that met something, counter-clockwise."""

    points: Array
    """(m, 2) m"""
    by_range: Array
    """(m, 2) how far one sigma of its range moves each, m"""
    by_bearing: Array
    """(m, 2) how far one sigma of its bearing does"""
    ranges: Array
    """(m,) m"""
    beams: NDArray[np.intp]
    """(m,) which of the scan's"""


class Spacing(NamedTuple):
    """How beams follow each other, and what may lie between two that met the same surface."""

    n_beams: int
    step: float
    """rad from one to the next"""
    seam: float
    """rad from the last one to the first; 0 where the scan is no full turn"""
    missing: int
    """Beams between two returns that may have met nothing"""
    flattest: float
    """rad between beam and surface, at least"""
    sigma_range: float
    """m"""
    sigma_bearing: float
    """rad"""


def returns_of(scan: Scan, sigma_range: float, sigma_bearing: float) -> Returns:
    """The returns of a scan whose ranges [m] and bearings [rad] are so noisy."""
    hit = np.flatnonzero(scan.hit)
    ranges, directions = scan.ranges[hit], scan.directions[hit]
    return Returns(
        scan.origins[hit] + ranges[:, None] * directions,
        sigma_range * directions,
        sigma_bearing * ranges[:, None] * scan.turns[hit],
        ranges,
        hit,
    )


def rolled(returns: Returns, first: int) -> Returns:
    """The same, beginning with another one."""
    order = np.roll(np.arange(len(returns.beams)), -first)
    return Returns(
        returns.points[order],
        returns.by_range[order],
        returns.by_bearing[order],
        returns.ranges[order],
        returns.beams[order],
    )
