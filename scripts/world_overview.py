"""A world seen from above, drawn as a map: ground and relief, what stands, where the goals are.

Everything has the mean colour of its texture, and the ground a wash of it.
"""

import math
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from grouser.envs.simulation.ground import Ground
from grouser.envs.simulation.renderers.textures import texture_colours
from grouser.envs.simulation.world import Boxes, World
from grouser.envs.simulation.worlds.footprint import heights_under
from grouser.envs.simulation.worlds.reachability import HEADROOM
from grouser.geometry import Array

Image = NDArray[np.uint8]
Colour = tuple[float, float, float]  # RGB

_INK, _START, _GOAL, _PAPER = (36, 36, 40), (226, 74, 30), (126, 44, 160), (250, 250, 248)
_FINENESS = 3  # drawn so many times larger, then shrunk: smooth edges
_CONTOUR = 0.25  # m between two contour lines
_RELIEF_LIGHT = np.array([-0.5, 0.5, 0.7]) / np.linalg.norm([-0.5, 0.5, 0.7])
_EXAGGERATION = 2.5  # of slopes in the shading
_CROWN_OPACITY = 0.55
_GROUND_OPACITY = 0.55  # of the ground's colour on the paper, so that things stand out from it


class Overview:
    """Draws one world into a square image, north (y) up, x to the right.

    Args:
        size: side of the image, px.
    """

    def __init__(self, world: World, size: int) -> None:
        self._world, self._size = world, size
        ground = world.ground
        self._extent = np.array(ground.material.shape[::-1]) * ground.cell
        self._px = size * _FINENESS / float(self._extent.max())  # a metre
        self._middle = ground.origin + self._extent / 2
        self._colours: list[Colour] = [(r, g, b) for r, g, b in texture_colours().tolist()]
        self._sheet: Any = None

    def draw(self) -> Image:
        """A new RGB image (size, size, 3)."""
        self._sheet = self._ground()
        self._draw_boxes(self._world.slabs, outlined=False)
        standing = _is_standing(self._world.solids, self._world.ground)
        self._draw_boxes(self._world.solids, chosen=standing)
        self._draw_trunks()
        self._draw_crowns(~standing)
        self._draw_goals()
        self._draw_start()
        self._draw_scale()
        small = cv2.resize(self._sheet, (self._size, self._size), interpolation=cv2.INTER_AREA)
        return np.asarray(small, dtype=np.uint8)

    def _ground(self) -> Image:
        """Materials in their colours, shaded by the slope, with contour lines."""
        ground, n = self._world.ground, self._size * _FINENESS
        steps = (np.arange(n) + 0.5 - n / 2) / self._px
        x, y = np.meshgrid(self._middle[0] + steps, self._middle[1] - steps)
        xy = np.stack([x, y], axis=-1)
        washed = _GROUND_OPACITY * texture_colours() + (1 - _GROUND_OPACITY) * np.array(_PAPER)
        colour = washed[ground.textures[ground.material_at(xy)]]
        if not ground.is_level:
            colour *= _hillshade(ground, xy)[..., None]
            colour[_contours(ground.height(xy))] *= 0.86
        beyond = np.any(np.abs(xy - self._middle) > self._extent / 2, axis=-1)
        colour[beyond] = _PAPER
        return np.clip(colour, 0, 255).astype(np.uint8)

    def _draw_boxes(
        self, boxes: Boxes, *, chosen: NDArray[np.bool_] | None = None, outlined: bool = True
    ) -> None:
        picked = range(len(boxes)) if chosen is None else np.flatnonzero(chosen).tolist()
        corners = self._corners(boxes)
        for k in picked:
            colour = self._colours[boxes.texture[k]]
            cv2.fillConvexPoly(self._sheet, corners[k], colour, cv2.LINE_AA)
            ink = _INK if outlined else _darker(colour)
            cv2.polylines(self._sheet, [corners[k]], True, ink, _FINENESS // 2 + 1, cv2.LINE_AA)

    def _draw_crowns(self, chosen: NDArray[np.bool_]) -> None:
        """What hangs above the robot, so that one sees through it."""
        below = self._sheet.copy()
        self._draw_boxes(self._world.solids, chosen=chosen, outlined=False)
        self._sheet = cv2.addWeighted(self._sheet, _CROWN_OPACITY, below, 1 - _CROWN_OPACITY, 0)

    def _draw_trunks(self) -> None:
        trunks = self._world.cylinders
        centres = self._pixels(trunks.centre[:, :2])
        for centre, radius, texture in zip(centres, trunks.radius, trunks.texture, strict=True):
            r = max(_FINENESS, round(radius * self._px))
            cv2.circle(self._sheet, centre, r, self._colours[texture], -1, cv2.LINE_AA)
            cv2.circle(self._sheet, centre, r, _INK, _FINENESS // 2 + 1, cv2.LINE_AA)

    def _draw_goals(self) -> None:
        for xy in self._pixels(self._world.goals):
            cv2.circle(self._sheet, xy, 6 * _FINENESS, _PAPER, -1, cv2.LINE_AA)
            cv2.circle(self._sheet, xy, 5 * _FINENESS, _GOAL, -1, cv2.LINE_AA)
            cv2.circle(self._sheet, xy, 2 * _FINENESS, _PAPER, -1, cv2.LINE_AA)

    def _draw_start(self) -> None:
        """The clear place, and an arrow in the direction in which the robot stands."""
        x, y, heading = self._world.start
        centre = self._pixels(np.array([[x, y]]))[0]
        radius = round(self._world.clear_radius * self._px)
        cv2.circle(self._sheet, centre, radius, _START, _FINENESS // 2 + 1, cv2.LINE_AA)
        arrow = np.array([[1.3, 0.0], [-0.8, 0.75], [-0.4, 0.0], [-0.8, -0.75]]) * 8 * _FINENESS
        c, s = math.cos(heading), math.sin(heading)
        turned = arrow @ np.array([[c, -s], [s, c]]) + centre  # rows are y down: -heading
        tip = np.rint(turned).astype(np.int32)
        cv2.fillPoly(self._sheet, [tip], _START, cv2.LINE_AA)
        cv2.polylines(self._sheet, [tip], True, _PAPER, _FINENESS // 2 + 1, cv2.LINE_AA)

    def _draw_scale(self) -> None:
        """A bar of five metres."""
        length, edge = round(5 * self._px), 8 * _FINENESS
        bottom = self._size * _FINENESS - edge
        box = (edge // 2, bottom - 16 * _FINENESS), (length + 3 * edge // 2, bottom + edge // 2)
        cv2.rectangle(self._sheet, *box, _PAPER, -1)
        cv2.line(self._sheet, (edge, bottom), (edge + length, bottom), _INK, _FINENESS)
        cv2.putText(
            self._sheet, "5 m", (edge, bottom - 4 * _FINENESS), cv2.FONT_HERSHEY_SIMPLEX,
            0.34 * _FINENESS, _INK, _FINENESS // 2 + 1, cv2.LINE_AA,
        )  # fmt: skip

    def _pixels(self, xy: Array) -> Any:
        """(n, 2) column and row of points (n, 2)."""
        offset = (xy - self._middle) * self._px * [1.0, -1.0]
        return np.rint(offset + self._size * _FINENESS / 2 - 0.5).astype(np.int32)

    def _corners(self, boxes: Boxes) -> Any:
        """(n, 4, 2) pixels of the corners of every footprint."""
        unit = np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]])
        own = unit * boxes.half_extents[:, None, :2]
        c, s = np.cos(boxes.yaw)[:, None], np.sin(boxes.yaw)[:, None]
        turned = [c * own[..., 0] - s * own[..., 1], s * own[..., 0] + c * own[..., 1]]
        return self._pixels(np.stack(turned, axis=-1) + boxes.centre[:, None, :2])


def _is_standing(solids: Boxes, ground: Ground) -> NDArray[np.bool_]:
    """(n,) whether the robot cannot drive below."""
    bottom = solids.centre[:, 2] - solids.half_extents[:, 2]
    return np.asarray(bottom < heights_under(solids, ground).max(axis=1) + HEADROOM)


def _hillshade(ground: Ground, xy: Array) -> Array:
    """(...) brightness of exaggerated slopes in the light from the upper left."""
    normal = ground.normal(xy) * [_EXAGGERATION, _EXAGGERATION, 1.0]
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    return np.asarray(0.35 + 0.65 / _RELIEF_LIGHT[2] * np.clip(normal @ _RELIEF_LIGHT, 0, 1))


def _contours(height: Array) -> NDArray[np.bool_]:
    """Where a pixel and the next lie on two sides of a multiple of _CONTOUR."""
    level = np.floor(height / _CONTOUR)
    line = np.zeros(height.shape, dtype=np.bool_)
    line[:, 1:] |= np.diff(level, axis=1) != 0
    line[1:] |= np.diff(level, axis=0) != 0
    return line


def _darker(colour: Colour) -> Colour:
    r, g, b = colour
    return 0.7 * r, 0.7 * g, 0.7 * b
