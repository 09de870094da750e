"""A map of lines beside what truly stands there."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from grouser.estimators.line_slam.lines import line_through, turned_over
from grouser.estimators.line_slam.map import LineMap
from grouser.geometry import Array, compose, wrap

THIRD = 2
"""Index of the line that is longer in one of the worlds."""

_METRE = 0.05
"""How far off in direction [rad] is as bad as a metre off in distance."""


@dataclass(frozen=True, slots=True)
class MapErrors:
    """Of the lines that were found."""

    r: float
    """m, mean"""
    alpha: float
    """rad, mean"""
    third_end: float
    """Largest x of the third line in the world, m; NaN where it was not found."""


def map_errors(line_map: LineMap, segments: Array, start: Array) -> MapErrors:
    """Each line against the true one that is nearest.

    Args:
        segments: (n, 4) what stands there, in the map's frame, m.
        start: (3,) the map's frame in the world.
    """
    name, nearest = nearest_lines(line_map.lines, true_lines(segments))
    thirds = ends_in_world(line_map, start)[name == THIRD]
    r, alpha = nearest.mean(axis=0)
    third_end = thirds[..., 0].max() if len(thirds) else np.nan
    return MapErrors(float(r), float(alpha), float(third_end))


def true_lines(segments: Array) -> Array:
    """(n, 2) the lines of segments (n, 4)."""
    return line_through(segments[:, :2], segments[:, 2:])


def nearest_lines(lines: Array, true: Array) -> tuple[NDArray[np.intp], Array]:
    """(n,) which of the true lines (m, 2) each of lines (n, 2) is nearest to, and (n, 2) how far it
    is off, m and rad."""
    apart = np.stack([lines, turned_over(lines)])[:, :, None] - true
    apart[..., 1] = wrap(apart[..., 1])
    off = np.abs(apart)
    far = (off @ [_METRE, 1.0]).transpose(1, 0, 2).reshape(len(lines), -1)
    side, name = np.divmod(np.argmin(far, axis=1), len(true))
    return name, off[side, np.arange(len(lines)), name]


def ends_in_world(line_map: LineMap, start: Array) -> Array:
    """(n, 2, 2) both ends of every line, m."""
    points = np.concatenate([line_map.ends, np.zeros((len(line_map), 2, 1))], axis=-1)
    return np.asarray(compose(start, points)[..., :2])
