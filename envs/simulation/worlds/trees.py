"""Trees: an upright trunk, and a crown of boxes that hang high enough to drive below."""

import numpy as np

from grouser.envs.simulation.ground import Ground
from grouser.envs.simulation.world import Boxes, Cylinders, join
from grouser.envs.simulation.worlds.footprint import heights_under
from grouser.envs.simulation.worlds.placement import (
    between_heights,
    standing_cylinders,
    texture_index,
)
from grouser.geometry import Array


def grown_trees(
    ground: Ground,
    xy: Array,
    radius: Array,
    *,
    clearance: Array,
    crown_width: Array,
    crown_height: Array,
    yaw: Array,
) -> tuple[Cylinders, Boxes]:
    """Trunks and crowns of n trees.

    Args:
        xy: (n, 2) m.
        radius: (n,) of the trunks, m.
        clearance: (n,) of the crowns above the highest ground below them, m.
        crown_width, crown_height: (n,) m.
        yaw: (n,) of the crowns, rad.
    """
    n = len(radius)
    lower = _crown(xy, crown_width, yaw)
    bottom = heights_under(lower, ground).max(axis=1) + clearance
    waist = bottom + 0.6 * crown_height
    upper = _crown(xy, 0.6 * crown_width, yaw + 0.5)
    crowns = join(
        between_heights(lower, bottom, waist), between_heights(upper, waist, bottom + crown_height)
    )
    trunk_height = bottom - ground.height(xy) + 0.3 * crown_height
    bark = np.full(n, texture_index("bark"))
    return standing_cylinders(ground, xy, radius, trunk_height, bark), crowns


def _crown(xy: Array, width: Array, yaw: Array) -> Boxes:
    n = len(width)
    flat = np.column_stack([xy, np.zeros(n)])
    half = np.column_stack([width / 2, width / 2, np.zeros(n)])
    return Boxes(flat, half, yaw, np.full(n, texture_index("foliage")))
