"""FAST corners, evenly over the image: every cell of a grid keeps a threshold of its own.

One threshold for the whole image finds its corners on the façades and none on the road, where
the points lie near and tell most of the motion.
"""

import cv2
import numpy as np
from numpy.typing import NDArray

from grouser.estimators.visual.descriptor import PATCH_RADIUS, Image
from grouser.geometry import Array
from grouser.kernels import kernel

GRID = (4, 3)
"""Columns and rows of cells that each have their share of the features."""
_THRESHOLDS = (6.0, 80.0)  # grey levels
_START = 20.0
_OVERLAP = 4  # px that FAST and its non-maximum suppression look beyond a corner


class CornerDetector:
    """Finds about a wanted number of corners; its only state is the cells' thresholds."""

    def __init__(self, wanted: int) -> None:
        self._wanted = wanted / (GRID[0] * GRID[1])
        self.reset()

    def reset(self) -> None:
        """Forget what earlier images led to."""
        self._thresholds = np.full(GRID[0] * GRID[1], _START)

    def detect(self, image: Image) -> NDArray[np.int32]:
        """Corners (n, 2) x, y [px], ordered by row, whose descriptor fits into the image."""
        height, width = image.shape
        xs = np.linspace(PATCH_RADIUS, width - PATCH_RADIUS, GRID[0] + 1).astype(int)
        ys = np.linspace(PATCH_RADIUS, height - PATCH_RADIUS, GRID[1] + 1).astype(int)
        found = [
            self._detect_cell(image, xs[i], xs[i + 1], ys[j], ys[j + 1], GRID[0] * j + i)
            for j in range(GRID[1])
            for i in range(GRID[0])
        ]
        corners = np.concatenate(found)
        return np.ascontiguousarray(corners[np.lexsort((corners[:, 0], corners[:, 1]))])

    def adapt(self, corners: NDArray[np.int32], shape: tuple[int, int]) -> bool:
        """Move every threshold towards the wanted number of corners, a little; True once settled.

        A first image may need several rounds; after it, cells follow the scene.
        """
        height, width = shape
        column = ((corners[:, 0] - PATCH_RADIUS) * GRID[0]) // (width - 2 * PATCH_RADIUS)
        row = ((corners[:, 1] - PATCH_RADIUS) * GRID[1]) // (height - 2 * PATCH_RADIUS)
        cell = np.minimum(column, GRID[0] - 1) + GRID[0] * np.minimum(row, GRID[1] - 1)
        found = np.bincount(cell, minlength=len(self._thresholds))
        factor = np.where(found > 1.3 * self._wanted, 1.2, 1.0)
        factor = np.where(found < 0.7 * self._wanted, 1 / 1.2, factor)
        before = self._thresholds
        self._thresholds = np.clip(before * factor, *_THRESHOLDS)
        return bool((self._thresholds == before).all())

    def _detect_cell(
        self, image: Image, x0: int, x1: int, y0: int, y1: int, cell: int
    ) -> NDArray[np.int32]:
        detector = cv2.FastFeatureDetector.create(
            threshold=int(self._thresholds[cell]), nonmaxSuppression=True
        )
        window = image[y0 - _OVERLAP : y1 + _OVERLAP, x0 - _OVERLAP : x1 + _OVERLAP]
        points = np.asarray(cv2.KeyPoint.convert(detector.detect(window)), dtype=np.int32)
        points = points.reshape(-1, 2) + (x0 - _OVERLAP, y0 - _OVERLAP)
        x, y = points[:, 0], points[:, 1]
        return np.asarray(points[(x >= x0) & (x < x1) & (y >= y0) & (y < y1)], dtype=np.int32)


@kernel
def strength(image: Image, points: Array) -> Array:
    """Smaller eigenvalue (n,) of the gradient's second moments over 7 x 7 px (Shi and Tomasi)."""
    out = np.empty(points.shape[0])
    for i in range(points.shape[0]):
        u, v = int(points[i, 0]), int(points[i, 1])
        xx = yy = xy = 0.0
        for y in range(v - 3, v + 4):
            for x in range(u - 3, u + 4):
                gx = float(image[y, x + 1]) - float(image[y, x - 1])
                gy = float(image[y + 1, x]) - float(image[y - 1, x])
                xx += gx * gx
                yy += gy * gy
                xy += gx * gy
        out[i] = 0.5 * (xx + yy - np.sqrt((xx - yy) ** 2 + 4 * xy * xy))
    return out
