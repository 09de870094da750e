"""The ground under boxes: what they must reach down to, what stands on them or they on."""

from dataclasses import fields

import numpy as np
from numpy.typing import NDArray

from grouser.envs.simulation.ground import Ground
from grouser.envs.simulation.world import Boxes
from grouser.geometry import Array

_SAMPLES = 7  # along either side of a footprint


def footprint_points(boxes: Boxes) -> Array:
    """(n, 49, 2) points on a grid over every footprint, its corners among them, m."""
    side = np.linspace(-1, 1, _SAMPLES)
    unit = np.stack(np.meshgrid(side, side), axis=-1).reshape(-1, 2)
    own = unit * boxes.half_extents[:, None, :2]
    c, s = np.cos(boxes.yaw)[:, None], np.sin(boxes.yaw)[:, None]
    turned = [c * own[..., 0] - s * own[..., 1], s * own[..., 0] + c * own[..., 1]]
    return np.stack(turned, axis=-1) + boxes.centre[:, None, :2]


def heights_under(boxes: Boxes, ground: Ground) -> Array:
    """(n, 49) m: the ground at `footprint_points`."""
    if ground.is_level:
        return np.zeros((len(boxes), _SAMPLES**2))
    return ground.height(footprint_points(boxes))


def lowest_under(boxes: Boxes, ground: Ground, steepest: float) -> Array:
    """(n,) m: no point of the ground under a box lies lower, if none is steeper than a slope
    (rise over run)."""
    between = boxes.footprint_radius / (_SAMPLES - 1)  # from any point to the nearest sample
    return np.asarray(heights_under(boxes, ground).min(axis=1) - steepest * between)


def select(boxes: Boxes, chosen: NDArray[np.bool_]) -> Boxes:
    """Those boxes that are chosen (n,)."""
    return Boxes(*(getattr(boxes, f.name)[chosen] for f in fields(Boxes)))
