"""When each row of a picture sees: an open shutter blurs, a rolling one skews."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from grouser.envs.simulation.motion import Motion
from grouser.geometry import Array

_NEAR = 0.5
"""What is nearer to the camera than this may move by more pixels between two renderings, m."""
_MOST_RENDERINGS = 16
_INSTANTS = 16
"""At which an exposure is sampled when it is shared out to the renderings around them."""


@dataclass(frozen=True, slots=True)
class Shutter:
    """How a camera exposes; all times in s.

    Row r of n is exposed from `age` + `readout` (1 - r / (n - 1)) + `exposure` before the end of
    the motion until `exposure` later.
    """

    exposure: float
    readout: float
    age: float

    @property
    def is_instant(self) -> bool:
        """Whether all of a picture is of one instant."""
        return self.exposure == 0 and self.readout == 0

    def ages(self, motion: Motion, mount: Array, focal_length: float) -> Array:
        """(k,) ages of the renderings that the picture is made of, youngest first.

        They are so dense that the picture moves by about a pixel between two of them.
        """
        if self.is_instant:
            return np.array([self.age])
        oldest = self.age + self.readout + self.exposure
        begin, end = motion.pose_at(oldest) @ mount, motion.pose_at(self.age) @ mount
        turned = math.acos(min(max((np.trace(begin[:3, :3].T @ end[:3, :3]) - 1) / 2, -1.0), 1.0))
        moved = float(np.linalg.norm(end[:3, 3] - begin[:3, 3]))
        pixels = focal_length * (turned + moved / _NEAR)
        return np.linspace(self.age, oldest, 2 + min(int(pixels), _MOST_RENDERINGS - 2))

    def expose(self, renderings: Sequence[NDArray[np.uint8]], ages: Array) -> NDArray[np.float32]:
        """The picture (height, width, channels) as the mean light of each row's exposure.

        Args:
            renderings: at each of these ages.
            ages: (k,) as `ages` gives them.
        """
        if len(renderings) == 1:
            return renderings[0].astype(np.float32)
        shares = self._shares(ages, len(renderings[0])).astype(np.float32)
        total = np.zeros(renderings[0].shape, dtype=np.float32)
        for share, rendering in zip(shares.T, renderings, strict=True):
            total += share[:, None, None] * rendering
        return total

    def _shares(self, ages: Array, height: int) -> Array:
        """(height, k) how much of each rendering is in each row: linear interpolation in time."""
        row = np.arange(height) / max(height - 1, 1)
        instant = (np.arange(_INSTANTS) + 0.5) / _INSTANTS if self.exposure > 0 else np.zeros(1)
        age = self.age + self.readout * (1 - row[:, None]) + self.exposure * instant
        at = (age - ages[0]) / (ages[1] - ages[0])
        near = np.maximum(0.0, 1 - np.abs(at[:, :, None] - np.arange(len(ages))))
        return np.asarray(near.mean(axis=1))
