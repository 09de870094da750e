"""The plane from above: segments, what is visible of them, the course, the vehicle and its way."""

from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from grouser.envs.plane.world import PlaneWorld
from grouser.geometry import Array

_WIDTH, _HEIGHT, _MARGIN = 640, 480, 30  # px
_PAPER, _INK, _VISIBLE = (250, 250, 248), (60, 60, 66), (0, 158, 115)
_WAY, _VEHICLE, _COURSE, _REACH = (0, 114, 178), (213, 94, 0), (204, 121, 167), (214, 222, 230)
_FRACTION_BITS = 4  # OpenCV takes places in sixteenths of a pixel
_NOSE = np.array([[12.0, 0.0], [-8.0, 7.0], [-8.0, -7.0]])  # px, x forward


class PlanePicture:
    """Draws one world, y up; the way is what lies between the poses that were drawn.

    Args:
        reach: how far the sensors see, m.
    """

    def __init__(self, world: PlaneWorld, *, reach: float) -> None:
        self._world, self._reach = world, reach
        shown = np.concatenate(
            [world.segments.reshape(-1, 2), world.waypoints, world.start[None, :2]]
        )
        low, high = shown.min(axis=0), shown.max(axis=0)
        room = np.array([_WIDTH, _HEIGHT]) - 2 * _MARGIN
        self._px = float((room / np.maximum(high - low, 1.0)).min())  # a metre
        self._middle = (low + high) / 2
        self._way = [world.start[:2].copy()]

    def draw(self, pose: Array, visible: Array) -> NDArray[np.uint8]:
        """A new RGB image (480, 640, 3) of a vehicle at a pose (3,) that sees parts (n, 4) [m]."""
        self._way.append(pose[:2].copy())
        sheet = np.full((_HEIGHT, _WIDTH, 3), _PAPER, dtype=np.uint8)
        self._circle(sheet, pose[:2], self._reach * self._px, _REACH, -1)
        self._lines(sheet, self._world.segments, _INK, 2)
        self._lines(sheet, visible[~np.isnan(visible[:, 0])], _VISIBLE, 4)
        for waypoint in self._world.waypoints:
            self._circle(sheet, waypoint, 4.0, _COURSE, -1)
        way = self._at(np.array(self._way))
        cv2.polylines(sheet, [way], False, _WAY, 2, cv2.LINE_AA, _FRACTION_BITS)
        cv2.fillPoly(sheet, [self._nose(pose)], _VEHICLE, cv2.LINE_AA, _FRACTION_BITS)
        return sheet

    def _lines(self, sheet: Any, ends: Array, colour: tuple[int, int, int], thick: int) -> None:
        for a, b in self._at(ends.reshape(-1, 2, 2)):
            cv2.line(sheet, a.tolist(), b.tolist(), colour, thick, cv2.LINE_AA, _FRACTION_BITS)

    def _circle(
        self, sheet: Any, centre: Array, radius_px: float, colour: tuple[int, int, int], thick: int
    ) -> None:
        radius = round(radius_px * 2**_FRACTION_BITS)
        at = self._at(centre).tolist()
        cv2.circle(sheet, at, radius, colour, thick, cv2.LINE_AA, _FRACTION_BITS)

    def _nose(self, pose: Array) -> NDArray[np.int32]:
        c, s = np.cos(pose[2]), np.sin(pose[2])
        corners = pose[:2] + _NOSE @ np.array([[c, s], [-s, c]]) / self._px
        return self._at(corners)

    def _at(self, points: Array) -> NDArray[np.int32]:
        """(..., 2) pixels, in sixteenths, of points (..., 2) [m]."""
        right_up = (points - self._middle) * self._px
        px = right_up * [1, -1] + [_WIDTH / 2, _HEIGHT / 2]
        return np.asarray(np.round(px * 2**_FRACTION_BITS), dtype=np.int32)
