"""SIFT features (Lowe 2004), as Wu et al. (paper 1's [7]) match them: slow, and hard to confuse."""

from typing import ClassVar

import cv2
import numpy as np
from numpy.typing import NDArray

from grouser.estimators.visual.corners import GRID
from grouser.estimators.visual.descriptor import PATCH_RADIUS, Image
from grouser.estimators.visual.features import FeatureExtractor, Features, Likeness
from grouser.geometry import Array

_LENGTH = 128
_CONTRAST = 0.01  # OpenCV's own 0.04 finds nothing on a road; the best of every cell are kept
_LAYERS, _EDGE, _BLUR = 3, 10.0, 1.6  # as Lowe has them


class SiftFeatures(FeatureExtractor):
    """OpenCV's SIFT, evenly over the image; a feature's place is rounded to the pixel."""

    # Descriptors are about 512 long; Lowe's ratio of 0.8, of lengths, is 0.64 of their squares.
    likeness: ClassVar[Likeness] = Likeness(max_distance=300**2, ratio=0.64, row_ratio=0.64)

    def __init__(self, wanted: int) -> None:
        self._wanted = wanted

    def reset(self) -> None:
        """Images are looked at by themselves: there is nothing to forget."""

    def extract(self, left: Image, right: Image) -> tuple[Features, Features]:
        return self._extract(left), self._extract(right)

    def _extract(self, image: Image) -> Features:
        sift = cv2.SIFT.create(0, _LAYERS, _CONTRAST, _EDGE, _BLUR)
        found = sift.detect(image, None)
        places = np.rint(cv2.KeyPoint.convert(found)).astype(np.int32).reshape(-1, 2)
        response = np.array([point.response for point in found])
        kept = _even(places, response, self._wanted, image.shape)
        if len(kept) == 0:
            return Features(np.empty((0, 2), np.int32), np.empty((0, _LENGTH), np.uint8))
        described, descriptors = sift.compute(image, [found[i] for i in kept])
        places = np.rint(cv2.KeyPoint.convert(described)).astype(np.int32)
        order = np.lexsort((places[:, 0], places[:, 1]))
        # OpenCV gives whole numbers up to 255, as floats
        return Features(
            np.ascontiguousarray(places[order]), np.rint(descriptors[order]).astype(np.uint8)
        )


def _even(
    places: NDArray[np.int32], response: Array, wanted: int, shape: tuple[int, ...]
) -> NDArray[np.intp]:
    """Indices of the strongest of every cell of a grid, one a pixel, away from the edges."""
    height, width = shape
    x, y = places[:, 0], places[:, 1]
    inside = (x >= PATCH_RADIUS) & (x < width - PATCH_RADIUS)
    inside &= (y >= PATCH_RADIUS) & (y < height - PATCH_RADIUS)
    order = np.lexsort((y, x, -response))
    order = order[inside[order]]
    # A place with several orientations counts once.
    order = order[np.sort(np.unique(places[order], axis=0, return_index=True)[1])]
    cell = x[order] * GRID[0] // width + GRID[0] * (y[order] * GRID[1] // height)
    by_cell = np.argsort(cell, kind="stable")
    sorted_cell = cell[by_cell]
    rank = np.arange(len(order)) - np.searchsorted(sorted_cell, sorted_cell)
    return order[by_cell[rank < wanted / (GRID[0] * GRID[1])]]
