"""What Replay-v0 plays: frames of observations, and where the robot was where that is known."""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import Any

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from grouser.geometry import Array
from grouser.rig import Rig


class Recording(ABC):
    """N frames that were found to be complete and consistent when the recording was opened."""

    rig: Rig
    """What the recording says of its robot."""
    stamps: Array
    """(N,) s, from zero, growing."""
    sensors: tuple[str, ...]
    """Observation keys beside `stamp`, in alphabetical order."""
    increments: Mapping[str, Array]
    """Those of `sensors` that measure the motion, (N, k) each: since the frame before, 0 first."""

    def __len__(self) -> int:
        return len(self.stamps)

    @abstractmethod
    def check(self, rig: Rig) -> None:
        """Check a rig with overrides.

        Raises:
            ValueError: it is not of what was recorded.
        """

    @abstractmethod
    def space(self, name: str, rig: Rig, *, color: bool) -> spaces.Box:
        """Of one sensor."""

    @abstractmethod
    def read(self, name: str, index: int, rig: Rig, *, color: bool) -> NDArray[Any]:
        """A sensor's reading in a frame, a new array.

        Raises:
            ValueError: it cannot be decoded.
        """

    @abstractmethod
    def base_poses(self, rig: Rig) -> Array | None:
        """(N, 4, 4) T_start_base, or None where they are not known."""

    @abstractmethod
    def picture(self, index: int, rig: Rig) -> NDArray[np.uint8]:
        """(H, W, 3) RGB, to look at a frame."""
