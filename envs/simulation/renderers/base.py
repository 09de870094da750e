"""What every renderer does: pictures of one world from poses of one camera."""

from abc import ABC, abstractmethod
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from grouser.geometry import Array

Image = NDArray[np.uint8]

NEAR = 0.05
"""What is nearer to a camera than this is not seen, m."""


class Renderer(ABC):
    """Draws one world through one camera; not for two threads at a time."""

    @abstractmethod
    def images(self, poses: Sequence[Array]) -> list[Image]:
        """A new image (height, width, 1 or 3) from each camera pose T_world_camera (4, 4)."""

    @abstractmethod
    def depth(self, T_world_camera: Array) -> NDArray[np.float32]:
        """(height, width) along the optical axis at the pixels' centres, m; inf for sky."""

    @abstractmethod
    def segmentation(self, T_world_camera: Array) -> NDArray[np.int32]:
        """(height, width) what shows at the pixels' centres: 0 sky, 1 ground, then 2 + index into
        the world's solids, cylinders and slabs in that order."""

    def close(self) -> None:  # noqa: B027 - a renderer may hold nothing
        """Free what it holds; a second call does nothing."""
