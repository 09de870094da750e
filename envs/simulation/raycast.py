"""Where rays first meet a box: the slab test (Kay and Kajiya, SIGGRAPH 1986), exact."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from grouser.envs.simulation.world import Boxes
from grouser.geometry import Array
from grouser.kernels import kernel


class RayCaster:
    """Casts bundles of rays from one point against upright boxes and the ground z = 0."""

    def __init__(self, boxes: Boxes) -> None:
        self._centre, self._half = boxes.centre, boxes.half_extents
        self._radius = boxes.footprint_radius
        self._turn = np.column_stack([np.cos(boxes.yaw), np.sin(boxes.yaw)])

    def cast(self, origin: Array, directions: Array, reach: float) -> NDArray[np.float64]:
        """(n,) distance along each unit direction (n, 3) to what is hit first, at most reach, m.

        What encloses the origin is not hit.
        """
        out = np.empty(len(directions))
        _cast(origin, directions, reach, self._centre, self._half, self._radius, self._turn, out)
        return out


@kernel
def _cast(
    origin: Any,
    directions: Any,
    reach: float,
    centre: Any,
    half: Any,
    radius: Any,
    turn: Any,
    out: Any,
) -> None:
    n = centre.shape[0]
    start = np.empty((n, 3))
    for k in range(n):  # the origin in each box's own axes
        dx, dy = origin[0] - centre[k, 0], origin[1] - centre[k, 1]
        start[k, 0] = turn[k, 0] * dx + turn[k, 1] * dy
        start[k, 1] = turn[k, 0] * dy - turn[k, 1] * dx
        start[k, 2] = origin[2] - centre[k, 2]
    for i in range(directions.shape[0]):
        dx, dy, dz = directions[i, 0], directions[i, 1], directions[i, 2]
        nearest = reach
        if dz < 0 and origin[2] > 0:
            nearest = min(nearest, -origin[2] / dz)
        for k in range(n):
            # Most boxes lie aside of the ray or behind it, seen from above: no slab test for them.
            to_x, to_y = centre[k, 0] - origin[0], centre[k, 1] - origin[1]
            if abs(dx * to_y - dy * to_x) > radius[k] or dx * to_x + dy * to_y < -radius[k]:
                continue
            along_x = turn[k, 0] * dx + turn[k, 1] * dy
            along_y = turn[k, 0] * dy - turn[k, 1] * dx
            enter, leave = _slab(start[k, 0], along_x, half[k, 0], -np.inf, np.inf)
            enter, leave = _slab(start[k, 1], along_y, half[k, 1], enter, leave)
            enter, leave = _slab(start[k, 2], dz, half[k, 2], enter, leave)
            if 0 < enter <= leave and enter < nearest:
                nearest = enter
        out[i] = nearest


@kernel
def _slab(start: float, along: float, half: float, enter: float, leave: float) -> Any:
    """The part of [enter, leave] on which |start + t along| <= half; leave < enter for none."""
    if along == 0.0:
        return (enter, leave) if abs(start) <= half else (np.inf, -np.inf)
    a, b = (-half - start) / along, (half - start) / along
    return max(enter, min(a, b)), min(leave, max(a, b))
