"""FAST corners with BRIEF descriptors (paper 1: FAST, matched by Hamming distance)."""

from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from grouser.estimators.visual.corners import CornerDetector
from grouser.estimators.visual.descriptor import Image, describe, smooth
from grouser.estimators.visual.features import FeatureExtractor, Features, Likeness


class FastFeatures(FeatureExtractor):
    """Its only state is the corner detector's thresholds."""

    likeness: ClassVar[Likeness] = Likeness(max_distance=64)  # of 256 bits

    def __init__(self, wanted: int) -> None:
        self._detector = CornerDetector(wanted)
        self._settled = False

    def reset(self) -> None:
        self._detector.reset()
        self._settled = False

    def extract(self, left: Image, right: Image) -> tuple[Features, Features]:
        corners = self._detect(left)
        return _described(left, corners), _described(right, self._detector.detect(right))

    def _detect(self, image: Image) -> NDArray[np.int32]:
        """Corners of the left image; thresholds follow it, and settle on the first."""
        corners = self._detector.detect(image)
        settled = self._detector.adapt(corners, image.shape)
        for _ in range(0 if self._settled or settled else _ROUNDS):
            corners = self._detector.detect(image)
            if self._detector.adapt(corners, image.shape):
                break
        self._settled = True
        return corners


def _described(image: Image, corners: NDArray[np.int32]) -> Features:
    return Features(corners, describe(smooth(image, _BLUR), corners))


_ROUNDS = 8
_BLUR = 2.0  # px: a descriptor's comparisons must not hang on a single pixel's noise
