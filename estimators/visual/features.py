"""What a kind of features does: find them in a pair of images, and tell like from unlike.

All that follows, stereo and temporal matching and sub-pixel alignment, is the same for every kind.
"""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from grouser.estimators.visual.descriptor import Descriptors, Image


@dataclass(frozen=True, slots=True)
class Features:
    """Places in an image with their descriptors."""

    places: NDArray[np.int32]
    """(n, 2) x, y [px], ordered by row, at least PATCH_RADIUS from the image's edge"""
    descriptors: Descriptors
    """(n, k)"""


@dataclass(frozen=True, slots=True)
class Likeness:
    """When two descriptors are taken for the same; their distance is `descriptor.difference`."""

    max_distance: int
    """Distances that are as large are too large."""
    ratio: float = 0.8
    """Over time: best over second best distance must be below."""
    row_ratio: float = 1.0
    """The same between the eyes."""


class FeatureExtractor(ABC):
    """Finds and describes the features of stereo pairs; a leaf is made with the number wanted."""

    likeness: ClassVar[Likeness]

    @abstractmethod
    def reset(self) -> None:
        """Forget what earlier images led to."""

    @abstractmethod
    def extract(self, left: Image, right: Image) -> tuple[Features, Features]:
        """Features of both images (H, W) uint8: about as many as are wanted, spread over them."""
