"""A world from above, with where the robot went and where it believed to be."""

import cv2
import numpy as np
from numpy.typing import NDArray

from grouser.envs.simulation.world import World
from grouser.envs.simulation.worlds.reachability import free_space
from grouser.geometry import Array, compose

_FREE, _BLOCKED = (235, 232, 225), (120, 110, 100)
_TRUE, _BELIEVED, _GOAL = (20, 140, 60), (235, 120, 20), (200, 30, 30)
_RADIUS = 0.05
"""Of the robot for the map, m: what is blocked is drawn about as large as it is."""
_GOAL_RADIUS = 0.3  # m


class TopView:
    """Draws what blocks the robot in a world, and its courses; x to the right, y up.

    Args:
        world: that the robot drives in.
    """

    def __init__(self, world: World) -> None:
        self._start = world.start
        self._space = free_space(world, radius=_RADIUS, cell=0.05)
        self._true, self._believed = [world.start[:2]], [world.start[:2]]

    def move(self, true: Array, believed: Array) -> None:
        """Go on to poses (3,), both in the frame of the start."""
        self._true.append(compose(self._start, true)[:2])
        self._believed.append(compose(self._start, believed)[:2])

    def picture(self, goal: Array, *, height: int) -> NDArray[np.uint8]:
        """RGB (height, as wide as it becomes, 3), with a goal (2,) [m, frame of the start]."""
        free = self._space.free[..., None]
        drawn = np.where(free, np.array(_FREE), np.array(_BLOCKED)).astype(np.uint8)
        scale = height / drawn.shape[0]
        width = round(drawn.shape[1] * scale)
        image = cv2.resize(drawn, (width, height), interpolation=cv2.INTER_NEAREST)
        for course, color in ((self._believed, _BELIEVED), (self._true, _TRUE)):
            cv2.polylines(image, [self._px(np.array(course), scale)], False, color, 2, cv2.LINE_AA)
        ring = self._px(compose(self._start, [*goal, 0.0])[None, :2], scale)[0]
        radius = round(_GOAL_RADIUS / self._space.cell * scale)
        cv2.circle(image, (int(ring[0]), int(ring[1])), radius, _GOAL, 2, cv2.LINE_AA)
        return np.ascontiguousarray(image[::-1], dtype=np.uint8)

    def _px(self, places: Array, scale: float) -> NDArray[np.int32]:
        """(n, 2) column and row of places (n, 2), before the picture is turned y up."""
        return np.rint((places - self._space.origin) / self._space.cell * scale).astype(np.int32)
