"""Putting things into worlds: where they do not overlap, and how they stand on the ground."""

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from grouser.envs.simulation.ground import Ground
from grouser.envs.simulation.materials import TEXTURES
from grouser.envs.simulation.world import Boxes, Cylinders
from grouser.envs.simulation.worlds.footprint import heights_under, lowest_under
from grouser.envs.simulation.worlds.relief import cell_slopes
from grouser.geometry import Array
from grouser.kernels import kernel


class NoPlace(Exception):
    """A generator found no room for what its world needs: it may try again."""


Allowed = Callable[[Array, Array], NDArray[np.bool_]]
"""Whether circles at (n, 2) with radii (n,) may be there."""

_TRIES = 48  # places that are tried for each thing


def texture_index(name: str) -> int:
    """Index into TEXTURES."""
    return TEXTURES.index(name)


def draw_textures(rng: np.random.Generator, n: int, *names: str) -> NDArray[np.int64]:
    """(n,) indices into TEXTURES of randomly chosen names."""
    return rng.choice([texture_index(name) for name in names], n)


class Circles:
    """Places that are taken, as circles seen from above."""

    def __init__(self, xy: ArrayLike, radius: ArrayLike) -> None:
        self.xy = np.asarray(xy, dtype=np.float64).reshape(-1, 2)
        self.radius = np.broadcast_to(np.asarray(radius, dtype=np.float64), (len(self.xy),))

    def plus(self, xy: Array, radius: ArrayLike) -> "Circles":
        """These and others."""
        others = Circles(xy, radius)
        return Circles(
            np.concatenate([self.xy, others.xy]), np.concatenate([self.radius, others.radius])
        )


def scatter(
    rng: np.random.Generator,
    radius: Array,
    reach: ArrayLike,
    taken: Circles,
    *,
    gap: float = 0.0,
    allowed: Allowed | None = None,
) -> tuple[Array, NDArray[np.int64]]:
    """Strew circles (n,) over a rectangle around the world's origin, as many as find a place.

    Args:
        radius: (n,) m.
        reach: half sides along x and y, m; circles lie wholly inside.
        taken: where none may be.
        gap: the least distance between two of them, and to what is taken, m.
        allowed: refuses further places.

    Returns:
        (k, 2) centres [m] and (k,) which of the n they are, ascending.
    """
    inside = np.asarray(reach) - radius[:, None, None]
    places = inside * rng.uniform(-1, 1, (len(radius), _TRIES, 2))
    fits = np.broadcast_to(inside[:, 0, :].min(axis=1)[:, None] > 0, places.shape[:2]).copy()
    if allowed is not None:
        flat = places.reshape(-1, 2)
        fits &= allowed(flat, np.repeat(radius, _TRIES)).reshape(fits.shape)
    chosen = np.full(len(radius), -1)
    _choose(places, fits, radius, taken.xy, taken.radius, gap, chosen)
    which = np.flatnonzero(chosen >= 0)
    return places[which, chosen[which]], which


@kernel
def _choose(
    places: Any, fits: Any, radius: Any, taken_xy: Any, taken_radius: Any, gap: float, chosen: Any
) -> None:
    """The first of each thing's places that keeps clear of what is taken and of all before."""
    for k in range(places.shape[0]):
        for i in range(places.shape[1]):
            if not fits[k, i]:
                continue
            x, y = places[k, i, 0], places[k, i, 1]
            free = True
            for j in range(taken_xy.shape[0]):
                apart = taken_radius[j] + radius[k] + gap
                dx, dy = taken_xy[j, 0] - x, taken_xy[j, 1] - y
                free = free and dx * dx + dy * dy > apart * apart
            for j in range(k):
                if chosen[j] >= 0:
                    apart = radius[j] + radius[k] + gap
                    dx, dy = places[j, chosen[j], 0] - x, places[j, chosen[j], 1] - y
                    free = free and dx * dx + dy * dy > apart * apart
            if free:
                chosen[k] = i
                break


def standing_boxes(
    ground: Ground, xy: ArrayLike, size: ArrayLike, yaw: ArrayLike, texture: ArrayLike
) -> Boxes:
    """Boxes on the ground.

    Args:
        xy: (n, 2) m.
        size: (n, 3) full length, width and height above the highest ground under the box, m; it
            reaches down to the lowest.
        yaw, texture: (n,) or one for all.
    """
    places = np.asarray(xy, dtype=np.float64).reshape(-1, 2)
    n = len(places)
    sizes = np.broadcast_to(np.asarray(size, dtype=np.float64), (n, 3))
    flat = Boxes(
        centre=np.column_stack([places, np.zeros(n)]),
        half_extents=sizes / 2,
        yaw=np.broadcast_to(np.asarray(yaw, dtype=np.float64), (n,)).copy(),
        texture=np.broadcast_to(np.asarray(texture, dtype=np.int64), (n,)).copy(),
    )
    top = heights_under(flat, ground).max(axis=1) + sizes[:, 2] if n else np.zeros(0)
    bottom = lowest_under(flat, ground, _steepest(ground))
    return between_heights(flat, bottom, top)


def between_heights(boxes: Boxes, bottom: Array, top: Array) -> Boxes:
    """The boxes from a bottom (n,) to a top (n,) [m] instead of their own."""
    half_height = (top - bottom) / 2
    return Boxes(
        centre=np.column_stack([boxes.centre[:, :2], bottom + half_height]),
        half_extents=np.column_stack([boxes.half_extents[:, :2], half_height]),
        yaw=boxes.yaw,
        texture=boxes.texture,
    )


def standing_cylinders(
    ground: Ground, xy: Array, radius: Array, height: Array, texture: ArrayLike
) -> Cylinders:
    """Trunks or posts (n,) on the ground, `height` (n,) above it; they reach into it."""
    n = len(radius)
    level = ground.height(xy)
    bottom = level - _steepest(ground) * radius
    return Cylinders(
        centre=np.column_stack([xy, (bottom + level + height) / 2]),
        radius=radius,
        half_height=(level + height - bottom) / 2,
        texture=np.broadcast_to(np.asarray(texture, dtype=np.int64), (n,)).copy(),
    )


def enclosure(
    ground: Ground,
    reach: ArrayLike,
    *,
    height: float,
    thickness: float = 0.3,
    segment: float = 5.0,
    texture: str,
) -> Boxes:
    """Walls around the rectangle of half sides `reach` [m], in segments that follow the ground."""
    reach_x, reach_y = np.asarray(reach, dtype=np.float64)
    parts = []
    for half_length, across, yaw in (
        (reach_x + thickness, reach_y + thickness / 2, 0.0),
        (reach_y, reach_x + thickness / 2, np.pi / 2),
    ):
        n = int(np.ceil(2 * half_length / segment))
        along = half_length * ((2 * np.arange(n) + 1) / n - 1)
        for side in (across, -across):
            beside = np.full(n, side)
            xy = [along, beside] if yaw == 0 else [beside, along]
            parts.append((np.column_stack(xy), np.full(n, 2 * half_length / n), np.full(n, yaw)))
    places, lengths, yaws = (np.concatenate(part) for part in zip(*parts, strict=True))
    n = len(lengths)
    size = np.column_stack([lengths, np.full(n, thickness), np.full(n, height)])
    return standing_boxes(ground, places, size, yaws, texture_index(texture))


def _steepest(ground: Ground) -> float:
    """The slope (rise over run) of the steepest triangle."""
    return 0.0 if ground.is_level else float(cell_slopes(ground.heights, ground.cell).max())
