"""When the frame that later ones are compared with is replaced (SPEC 1.5, step 6)."""

from dataclasses import dataclass

import numpy as np

from grouser.estimators.visual.sight import Sight
from grouser.geometry import Array


@dataclass(frozen=True, slots=True)
class KeyframeRule:
    """A keyframe serves while enough of it is in view; long enough that its noise averages out."""

    distance: float = 0.25
    """m"""
    turn: float = 0.2
    """rad"""
    frames: int = 60
    points: int = 64
    """Matched points that the estimation uses: fewer features in view are too few."""
    inlier_share: float = 0.42
    """Of `points`."""
    patience: int = 3
    """Frames in a row that may fail: a blurred one is no reason to let the keyframe go."""

    def replaces(self, relative: Array, sight: Sight, *, frames: int, failures: int) -> bool:
        """Whether the current frame becomes the keyframe.

        Args:
            relative: (3,) pose as seen from the keyframe.
            frames: since the keyframe.
            failures: frames in a row, up to this one, that vision failed on.
        """
        moved = np.hypot(relative[0], relative[1]) > self.distance or abs(relative[2]) > self.turn
        if sight.motion is None:
            return bool(moved) or failures >= self.patience
        few = self.sees_little(sight) or sight.diagnostics["candidates"] < self.points
        return bool(moved or few or frames >= self.frames)

    def sees_little(self, sight: Sight) -> bool:
        """Whether few of the keyframe's points are found again."""
        return bool(sight.diagnostics["inliers"] < self.inlier_share * self.points)
