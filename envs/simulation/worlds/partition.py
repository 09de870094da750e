"""Inner walls with doors, on level ground."""

import numpy as np

from grouser.envs.simulation.ground import Ground
from grouser.envs.simulation.world import Boxes, join
from grouser.envs.simulation.worlds.placement import between_heights, standing_boxes
from grouser.geometry import Array

WALL_HEIGHT, WALL_THICKNESS = 2.6, 0.15
"""Of walls within buildings, m."""

_DOOR_HEIGHT = 2.0  # from the floor to the lintel, m


def wall_with_door(
    ground: Ground, door: Array, ends: tuple[float, float], width: float, texture: int
) -> Boxes:
    """A wall along y with a door in it, and a lintel above the door: three boxes.

    Args:
        door: (2,) the middle of the door, m.
        ends: the lower and upper y of the wall, m.
        width: of the door, m.
        texture: index into TEXTURES.
    """
    x, y = door
    spans = np.array([[ends[0], y - width / 2], [y + width / 2, ends[1]]])
    middle, length = spans.mean(axis=1), np.diff(spans, axis=1)[:, 0]
    size = np.column_stack([np.full(2, WALL_THICKNESS), length, np.full(2, WALL_HEIGHT)])
    sides = standing_boxes(ground, np.column_stack([np.full(2, x), middle]), size, 0.0, texture)
    lintel = standing_boxes(ground, door, (WALL_THICKNESS, width, WALL_HEIGHT), 0.0, texture)
    return join(sides, between_heights(lintel, np.array([_DOOR_HEIGHT]), np.array([WALL_HEIGHT])))
