"""Which points the filter holds: those that are seen, spread over the image, a bounded number."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from grouser.estimators.monocular.appearance import Appearance
from grouser.estimators.monocular.picture import Picture
from grouser.estimators.monocular.state import HEAD, SlamState
from grouser.estimators.visual.corners import strength
from grouser.estimators.visual.descriptor import PATCH_RADIUS
from grouser.geometry import Array
from grouser.kernels import kernel


@dataclass(frozen=True, slots=True)
class MapOptions:
    """Of the map's size and its points' start."""

    points: int = 60
    """Most that the state holds."""
    spacing: float = 14.0
    """Least distance of a new point from every other, px in an image 320 px wide."""
    patience: int = 3
    """Frames in a row in which a point may not be found."""
    found_share: float = 0.5
    """Of the frames in which it was sought, less than which a point is given up."""
    inverse_depth: float = 0.5
    """1/m, of a new point."""
    inverse_depth_sigma: float = 6.0
    """Its sigma. Civera et al. let it reach from the nearest point to infinity; but hundreds of
    points of which each is said to be about so far add up to a measurement of the scale, and a
    wrong one. This says nothing."""


def worth_keeping(
    points: Array,
    state: SlamState,
    appearance: Appearance,
    size: tuple[int, int],
    options: MapOptions,
) -> NDArray[np.bool_]:
    """(n,) which points are in view, still found, and not behind infinity.

    Args:
        points: (n, 3) as seen now; NaN behind the camera.
        size: width and height of the image, px.
    """
    kept = in_view(points, size)
    kept &= appearance.missed <= options.patience
    kept &= appearance.found >= options.found_share * (appearance.sought - _PROBATION)
    sigma = np.sqrt(np.diag(state.covariance)[HEAD + 2 :: 3])
    return np.asarray(kept & (state.points[:, 2] > -3 * sigma))


def in_view(points: Array, size: tuple[int, int]) -> NDArray[np.bool_]:
    """(n,) which points (n, 3) lie in the image, with all of what they look like; False for NaN."""
    width, height = size
    inside = (points[:, 0] >= PATCH_RADIUS) & (points[:, 0] < width - PATCH_RADIUS)
    inside &= (points[:, 1] >= PATCH_RADIUS) & (points[:, 1] < height - PATCH_RADIUS)
    return np.asarray(inside)


_PROBATION = 4  # frames that a share is not yet worth judging by


def new_corners(
    picture: Picture, occupied: Array, wanted: int, spacing: float
) -> NDArray[np.int64]:
    """Indices of at most `wanted` corners, apart from all `occupied` (n, 2) places and each other.

    The emptiest cells of a grid get theirs first, their strongest ahead: far points tell of the
    rotation and near ones of the way, and the strongest corners of all are often in one place.
    """
    if wanted <= 0 or len(picture.corners) == 0:
        return np.zeros(0, dtype=np.int64)
    corners = picture.corners.astype(np.float64)
    score = strength(picture.aligned, corners)
    shape = picture.aligned.shape
    cell, taken = _cells(corners, shape), _cells(occupied, shape)
    by_cell = np.lexsort((-score, cell))
    first = np.searchsorted(cell[by_cell], cell[by_cell])
    rank = np.arange(len(by_cell)) - first
    crowd = rank + np.bincount(taken, minlength=_GRID[0] * _GRID[1])[cell[by_cell]]
    order = by_cell[np.lexsort((-score[by_cell], crowd))]
    return np.asarray(_apart(corners, order, occupied, wanted, spacing**2))


_GRID = (8, 6)  # columns and rows


def _cells(places: Array, shape: tuple[int, ...]) -> NDArray[np.int64]:
    """(n,) the cell of each place (n, 2)."""
    column = (places[:, 0] * _GRID[0] / shape[1]).astype(np.int64)
    row = (places[:, 1] * _GRID[1] / shape[0]).astype(np.int64)
    return np.asarray(column + _GRID[0] * row)


@kernel
def _apart(
    corners: Array, order: NDArray[np.int64], occupied: Array, wanted: int, least: float
) -> NDArray[np.int64]:
    chosen = np.empty(wanted, np.int64)
    count = 0
    for i in order:
        free = count < wanted
        for j in range(occupied.shape[0]):
            dx, dy = corners[i, 0] - occupied[j, 0], corners[i, 1] - occupied[j, 1]
            free = free and dx * dx + dy * dy >= least
        for j in range(count):
            dx = corners[i, 0] - corners[chosen[j], 0]
            dy = corners[i, 1] - corners[chosen[j], 1]
            free = free and dx * dx + dy * dy >= least
        if free:
            chosen[count] = i
            count += 1
    return chosen[:count]
