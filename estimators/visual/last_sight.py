"""Where the robot was last believed to be seen: what goes on in the dark goes on from there.

A pose that vision told is not wrong as the tracks before it are. Had the dark begun at the
keyframe, their errors and the pose's would be the same error, and who finds the one in the light
would move the other by as much.
"""

from dataclasses import dataclass

import numpy as np

from grouser.estimators.visual.fusion import Accumulated, FilterState
from grouser.estimators.visual.levelling import levelling
from grouser.estimators.visual.prediction import Increment
from grouser.geometry import Array


@dataclass(frozen=True, slots=True)
class LastSight:
    """The state then, and what was predicted since."""

    pose: Array
    """(3,) as seen from the keyframe"""
    pose_3d: Array
    """(4, 4) as seen from the start"""
    since: Accumulated
    state: FilterState | None = None
    """None where it is that at the keyframe"""

    @property
    def vertical(self) -> Array:
        """(3,) up as seen by the robot, were it level at the start."""
        return self.pose_3d[2, :3]

    def then(self, increment: Increment) -> "LastSight":
        """One more increment later."""
        return LastSight(self.pose, self.pose_3d, self.since.then(increment), self.state)

    def level(self) -> Array:
        """(3,) what its tilt adds to the way since."""
        added = np.empty(3)
        levelling(self.pose_3d, self.since.pose, 0.0, 0.0, added)
        return added
