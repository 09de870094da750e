"""Low slabs that tracks climb: sills, kerbs, roots, logs, rubble."""

import numpy as np
from numpy.typing import ArrayLike

from grouser.envs.simulation.ground import Ground
from grouser.envs.simulation.world import Boxes
from grouser.envs.simulation.worlds.footprint import heights_under, select
from grouser.envs.simulation.worlds.placement import between_heights
from grouser.envs.simulation.worlds.reachability import HIGHEST_STEP
from grouser.geometry import Array

_DEPTH = 0.1  # how far slabs reach into the ground, m


def laid_slabs(
    ground: Ground, xy: ArrayLike, size: ArrayLike, yaw: ArrayLike, texture: ArrayLike
) -> Boxes:
    """Slabs that lie level on the ground; those that would vanish in it are left out.

    Args:
        xy: (n, 2) m.
        size: (n, 3) full length, width and height above the lowest ground under the slab, m:
            HIGHEST_STEP at most.
        yaw, texture: (n,) or one for all.

    Raises:
        ValueError: a slab is higher than tracks climb.
    """
    places = np.asarray(xy, dtype=np.float64).reshape(-1, 2)
    n = len(places)
    sizes = np.broadcast_to(np.asarray(size, dtype=np.float64), (n, 3))
    if n and sizes[:, 2].max() > HIGHEST_STEP:
        raise ValueError(f"slabs are {HIGHEST_STEP} m high at most, got {sizes[:, 2].max():.3f} m")
    flat = Boxes(
        centre=np.column_stack([places, np.zeros(n)]),
        half_extents=sizes / 2,
        yaw=np.broadcast_to(np.asarray(yaw, dtype=np.float64), (n,)).copy(),
        texture=np.broadcast_to(np.asarray(texture, dtype=np.int64), (n,)).copy(),
    )
    below = heights_under(flat, ground)
    lowest, usual = below.min(axis=1), np.median(below, axis=1)
    laid = between_heights(flat, lowest - _DEPTH, lowest + sizes[:, 2])
    return select(laid, lowest + sizes[:, 2] > usual)


def along_contours(ground: Ground, xy: Array, turned: Array) -> Array:
    """(n,) yaw of things that lie across the slope at (n, 2), or are turned by (n,) from that."""
    nx, ny, _ = ground.normal(xy).T
    return np.asarray(np.arctan2(ny, nx) + np.pi / 2 + turned)


def apart_from(boxes: Boxes, xy: ArrayLike, radius: float) -> Boxes:
    """Those boxes that do not reach into a circle."""
    distance = np.linalg.norm(boxes.centre[:, :2] - np.asarray(xy), axis=1)
    return select(boxes, distance > boxes.footprint_radius + radius)
