"""One image as the filter looks at it: corners with descriptors, and grey values to align to."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from grouser.estimators.visual.corners import CornerDetector
from grouser.estimators.visual.descriptor import Descriptors, Image, describe, smooth


@dataclass(frozen=True, slots=True)
class Picture:
    """The smoothed image and its corners."""

    aligned: Image
    """(H, W) smoothed a little: patches are aligned in it"""
    described: Image
    """(H, W) smoothed more: descriptors are read from it"""
    corners: NDArray[np.int32]
    """(m, 2) x, y [px]"""
    descriptors: Descriptors
    """(m, 4)"""


class PictureTaker:
    """Turns images into pictures; its only state is the corner detector's."""

    def __init__(self, corners: int) -> None:
        """corners: sought in every image."""
        self._detector = CornerDetector(corners)
        self._settled = False

    def reset(self) -> None:
        """Forget what earlier images led to."""
        self._detector.reset()
        self._settled = False

    def take(self, image: Image) -> Picture:
        """Corners of an image (H, W); the detector's thresholds settle on the first."""
        corners = self._detector.detect(image)
        settled = self._detector.adapt(corners, image.shape)
        for _ in range(0 if self._settled or settled else _ROUNDS):
            corners = self._detector.detect(image)
            if self._detector.adapt(corners, image.shape):
                break
        self._settled = True
        described = smooth(image, _DESCRIPTOR_BLUR)
        return Picture(
            smooth(image, _ALIGNMENT_BLUR), described, corners, describe(described, corners)
        )


_ROUNDS = 8
# px; for the reasons given in `visual.frontend`
_ALIGNMENT_BLUR = 1.0
_DESCRIPTOR_BLUR = 2.0
