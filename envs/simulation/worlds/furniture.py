"""Furniture: tables and chairs on legs, cupboards along walls."""

import numpy as np

from grouser.envs.simulation.ground import Ground
from grouser.envs.simulation.world import Boxes, join
from grouser.envs.simulation.worlds.placement import standing_boxes, texture_index
from grouser.geometry import Array

TABLE = (1.5, 0.8)
"""Length and width of a table, m."""
CHAIR = 0.42
"""Side of a chair's seat, m."""

_TABLE_HEIGHT, _SEAT_HEIGHT, _BACK_HEIGHT = 0.74, 0.46, 0.88
_BOARD = 0.04  # thickness of tops, seats and backs, m


def table(ground: Ground, xy: Array, yaw: float) -> Boxes:
    """A table on four legs on level ground: its top hangs above the robot, which sees the legs."""
    return _on_legs(ground, xy, yaw, TABLE, _TABLE_HEIGHT, leg=0.06)


def chair(ground: Ground, xy: Array, yaw: float) -> Boxes:
    """A chair on four legs on level ground, its back on the side that the yaw points to."""
    seat = _on_legs(ground, xy, yaw, (CHAIR, CHAIR), _SEAT_HEIGHT, leg=0.04)
    middle = xy + (CHAIR - _BOARD) / 2 * np.array([np.cos(yaw), np.sin(yaw)])
    size = (_BOARD, CHAIR, _BACK_HEIGHT)
    return join(seat, standing_boxes(ground, middle, size, yaw, texture_index("bark")))


def _on_legs(
    ground: Ground, xy: Array, yaw: float, size: tuple[float, float], height: float, *, leg: float
) -> Boxes:
    c, s = np.cos(yaw), np.sin(yaw)
    signs = np.array([[1, 1], [1, -1], [-1, 1], [-1, -1]])
    own = signs * (np.array(size) - leg) / 2
    corners = xy + own @ np.array([[c, s], [-s, c]])
    legs = standing_boxes(
        ground, corners, (leg, leg, height - _BOARD), yaw, texture_index("concrete")
    )
    top = Boxes(
        centre=np.append(xy, height - _BOARD / 2)[None],
        half_extents=np.array([[size[0] / 2, size[1] / 2, _BOARD / 2]]),
        yaw=np.array([yaw]),
        texture=np.array([texture_index("bark")]),
    )
    return join(legs, top)
