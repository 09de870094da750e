"""Where rays first meet a world: boxes, cylinders and the ground, exact."""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from grouser.envs.simulation.raycast_ground import GroundGrid
from grouser.envs.simulation.world import Boxes, Cylinders, World, join
from grouser.geometry import Array
from grouser.kernels import kernel

# Columns of the table of upright things; a cylinder has its radius as both half widths.
_X, _Y, _Z, _HALF_HEIGHT, _AROUND, _HALF_X, _HALF_Y, _COS, _SIN, _IS_BOX = range(10)


class RayCaster:
    """Casts bundles of rays against a world's solids, cylinders, slabs and ground."""

    def __init__(self, world: World) -> None:
        boxes = _box_rows(join(world.solids, world.slabs))
        self._things = np.concatenate([boxes, _cylinder_rows(world.cylinders)])
        self._ground = GroundGrid(world.ground)

    def cast(self, origin: Array, directions: Array, reach: float) -> NDArray[np.float64]:
        """(n,) distance along each unit direction (n, 3) to what is hit first, at most reach, m.

        The rays start at one origin (3,), or each at its own (n, 3). What encloses an origin is
        not hit, nor is the ground from below.
        """
        origins = np.ascontiguousarray(np.atleast_2d(origin), dtype=np.float64)
        directions = np.ascontiguousarray(directions, dtype=np.float64)
        distance = np.empty(len(directions))
        _meet_upright_things(origins, directions, reach, self._things, distance)
        self._ground.shorten(origins, directions, distance)
        return distance


def _box_rows(boxes: Boxes) -> Array:
    return np.column_stack(
        [
            boxes.centre,
            boxes.half_extents[:, 2],
            boxes.footprint_radius,
            boxes.half_extents[:, :2],
            np.cos(boxes.yaw),
            np.sin(boxes.yaw),
            np.ones(len(boxes)),
        ]
    )


def _cylinder_rows(cylinders: Cylinders) -> Array:
    r, nothing = cylinders.radius, np.zeros(len(cylinders))
    return np.column_stack(
        [cylinders.centre, cylinders.half_height, r, r, r, nothing, nothing, nothing]
    )


@kernel
def _meet_upright_things(
    origins: Any, directions: Any, reach: float, things: Any, out: Any
) -> None:
    near, gap = _nearest_first(origins, directions, reach, things)
    n = directions.shape[0]
    ox, oy, dx, dy, level = np.empty(n), np.empty(n), np.empty(n), np.empty(n), np.empty(n)
    several = origins.shape[0] > 1
    for i in range(n):
        o = i if several else 0
        ox[i], oy[i], dx[i], dy[i] = (
            origins[o, 0],
            origins[o, 1],
            directions[i, 0],
            directions[i, 1],
        )
        level[i] = math.sqrt(dx[i] * dx[i] + dy[i] * dy[i])
        out[i] = reach
    toward = np.empty(n, dtype=np.bool_)
    for k in range(near.shape[0]):
        thing, x, y = near[k], near[k, _X], near[k, _Y]
        _look_toward(x, y, thing[_AROUND], gap[k], ox, oy, dx, dy, level, out, toward)
        for i in range(n):
            if not toward[i]:
                continue
            to_x, to_y = x - ox[i], y - oy[i]
            if thing[_IS_BOX] == 1.0:
                enter, leave = _through_box(thing, to_x, to_y, dx[i], dy[i])
            else:
                enter, leave = _through_cylinder(thing, to_x, to_y, dx[i], dy[i])
            above = origins[i if several else 0, 2] - thing[_Z]
            enter, leave = _slab(above, directions[i, 2], thing[_HALF_HEIGHT], enter, leave)
            if 0 < enter <= leave and enter < out[i]:
                out[i] = enter


@kernel
def _look_toward(
    x: float, y: float, around: float, gap: float, ox: Any, oy: Any, dx: Any, dy: Any, level: Any,
    nearest: Any, toward: Any,
) -> None:  # fmt: skip
    """Which rays a thing may shorten: most things lie aside of a ray or behind it, seen from above,
    or beyond what it has met. Without branches, for vector instructions."""
    for i in range(toward.size):
        to_x, to_y = x - ox[i], y - oy[i]
        beside = abs(dx[i] * to_y - dy[i] * to_x) <= around
        before = dx[i] * to_x + dy[i] * to_y >= -around
        toward[i] = beside & before & (gap <= nearest[i] * level[i])


@kernel
def _nearest_first(origins: Any, directions: Any, reach: float, things: Any) -> Any:
    """The things that some ray may meet, nearest first, and how far they are at least, seen from
    above."""
    ox, oy = origins[0, 0], origins[0, 1]
    spread, lowest, highest = 0.0, np.inf, -np.inf
    for i in range(origins.shape[0]):
        spread = max(spread, math.hypot(origins[i, 0] - ox, origins[i, 1] - oy))
    several = origins.shape[0] > 1
    for i in range(directions.shape[0]):
        z = origins[i if several else 0, 2]
        end = z + reach * directions[i, 2]
        lowest, highest = min(lowest, z, end), max(highest, z, end)
    gap = np.empty(things.shape[0])
    for k in range(things.shape[0]):
        away = math.hypot(things[k, _X] - ox, things[k, _Y] - oy)
        gap[k] = away - things[k, _AROUND] - spread
        below = things[k, _Z] + things[k, _HALF_HEIGHT] < lowest
        if below or things[k, _Z] - things[k, _HALF_HEIGHT] > highest:
            gap[k] = np.inf
    order = np.argsort(gap)
    n = np.searchsorted(gap[order], reach, side="right")
    return things[order[:n]], gap[order[:n]]


@kernel
def _through_box(box: Any, to_x: float, to_y: float, dx: float, dy: float) -> Any:
    """From where to where a ray is within a box, seen from above."""
    c, s = box[_COS], box[_SIN]
    start_x, start_y = -c * to_x - s * to_y, s * to_x - c * to_y
    enter, leave = _slab(start_x, c * dx + s * dy, box[_HALF_X], -np.inf, np.inf)
    return _slab(start_y, c * dy - s * dx, box[_HALF_Y], enter, leave)


@kernel
def _through_cylinder(cylinder: Any, to_x: float, to_y: float, dx: float, dy: float) -> Any:
    """From where to where it is within a cylinder, seen from above."""
    r2, level2 = cylinder[_AROUND] * cylinder[_AROUND], dx * dx + dy * dy
    if level2 == 0.0:
        inside = to_x * to_x + to_y * to_y <= r2
        return (-np.inf, np.inf) if inside else (np.inf, -np.inf)
    aside = dx * to_y - dy * to_x  # times the level part of the ray's length
    reach2 = r2 * level2 - aside * aside
    if reach2 < 0.0:
        return np.inf, -np.inf
    middle, half = dx * to_x + dy * to_y, math.sqrt(reach2)
    return (middle - half) / level2, (middle + half) / level2


@kernel
def _slab(start: float, along: float, half: float, enter: float, leave: float) -> Any:
    """The part of [enter, leave] on which |start + t along| <= half; leave < enter for none.

    (Kay and Kajiya, SIGGRAPH 1986.)
    """
    if along == 0.0:
        return (enter, leave) if abs(start) <= half else (np.inf, -np.inf)
    a, b = (-half - start) / along, (half - start) / along
    return max(enter, min(a, b)), min(leave, max(a, b))
