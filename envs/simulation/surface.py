"""What tracks run on: the ground's triangles, or the flat top of a slab where that is higher.

The edge of a slab is bevelled here, two to one. A track meets an edge with its curved front, which
patches a few centimetres apart cannot show: over a sharp edge a patch would be lifted in no time,
and the robot thrown up by energy from nowhere. On the bevel it must push itself up.
"""

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from grouser.envs.simulation.ground import ground_at
from grouser.envs.simulation.materials import Material, material_index
from grouser.envs.simulation.world import World
from grouser.geometry import Array
from grouser.kernels import kernel, kernel_using

_STEEPNESS = 2.0


class Surface(NamedTuple):
    """A world's ground and slabs as kernels read them."""

    heights: Any
    cell: float
    origin: Any
    material: Any
    table: Any
    """(material, 3): friction, shear modulus [m], resistance."""
    slabs: Any
    """(n, 9): centre x and y, cosine and sine of the yaw, half extents, height of the top, width
    and slope of the bevel."""
    slab_material: int

    @staticmethod
    def of(world: World, materials: Sequence[Material]) -> "Surface":
        """The surface of a world of which the grounds are these."""
        ground = world.ground
        table = np.array([[m.friction, m.shear_modulus, m.resistance] for m in materials])
        table[:, 0] *= ground.friction_scale
        # Copies: a kernel is compiled anew for arrays that may be written to, as those of a world
        # that was unpickled may.
        return Surface(
            np.array(ground.heights, dtype=np.float64, order="C"),
            float(ground.cell),
            np.array(ground.origin, dtype=np.float64, order="C"),
            np.array(ground.material, dtype=np.int64, order="C"),
            table,
            _slab_table(world),
            material_index("cement"),
        )


def _slab_table(world: World) -> Array:
    slabs, half = world.slabs, world.slabs.half_extents
    c, s, top = np.cos(slabs.yaw), np.sin(slabs.yaw), slabs.centre[:, 2] + half[:, 2]
    signs = np.array([[0, 0], [1, 1], [1, -1], [-1, 1], [-1, -1]])
    own = signs * half[:, None, :2]
    turned = np.stack([c[:, None] * own[..., 0] - s[:, None] * own[..., 1],
                       s[:, None] * own[..., 0] + c[:, None] * own[..., 1]], axis=-1)  # fmt: skip
    below = world.ground.height(slabs.centre[:, None, :2] + turned)
    rise = np.maximum(top - below.min(axis=1), 1e-9)
    # A narrow one keeps a flat half, with a steeper bevel.
    bevel = np.minimum(rise / _STEEPNESS, half[:, :2].min(axis=1) / 2)
    return np.column_stack([slabs.centre[:, :2], c, s, half[:, :2], top, bevel, rise / bevel])


@kernel
def look_around(surface: Any, x: float, y: float, reach: float, nearby: Any) -> Any:
    """How many slabs are within reach [m] of a point, their indices in nearby, and the height that
    nothing within reach exceeds, m."""
    heights, cell, origin, slabs = surface.heights, surface.cell, surface.origin, surface.slabs
    rows, columns = heights.shape[0] - 1, heights.shape[1] - 1
    first = min(max(int((x - reach - origin[0]) / cell), 0), columns)
    last = min(max(int((x + reach - origin[0]) / cell) + 1, 0), columns)
    lowest = min(max(int((y - reach - origin[1]) / cell), 0), rows)
    highest = min(max(int((y + reach - origin[1]) / cell) + 1, 0), rows)
    top = -np.inf
    for row in range(lowest, highest + 1):
        for column in range(first, last + 1):
            top = max(top, heights[row, column])
    n = 0
    for k in range(slabs.shape[0]):
        far = reach + slabs[k, 4] + slabs[k, 5]
        if abs(x - slabs[k, 0]) < far and abs(y - slabs[k, 1]) < far:
            nearby[n] = k
            n += 1
            top = max(top, slabs[k, 6])
    return n, top


@kernel_using(ground_at)
def surface_under(
    state: Any, R: Any, points: Any, surface: Any, nearby: Any, n_nearby: int, top: float,
    touched: Any,
) -> int:  # fmt: skip
    """Which points of the robot are below the surface, as far as slabs of nearby go; how many.

    Args:
        state: (13,) its centre of mass first.
        R: (3, 3) its rotation.
        points: (m, 3) from the centre of mass along its axes, m.
        nearby, n_nearby, top: what `look_around` found.
        touched: out, (m, 9) a row each: index of the point; itself from the centre of mass in the
            world frame, m; its gap, below zero [m], and unit normal; the material.
    """
    heights, cell, origin, material, _, slabs, slab_material = surface
    x0, y0, z0 = state[0], state[1], state[2]
    n = 0
    for k in range(points.shape[0]):
        px, py, pz = points[k, 0], points[k, 1], points[k, 2]
        rz = R[2, 0] * px + R[2, 1] * py + R[2, 2] * pz
        if z0 + rz >= top:
            continue
        rx = R[0, 0] * px + R[0, 1] * py + R[0, 2] * pz
        ry = R[1, 0] * px + R[1, 1] * py + R[1, 2] * pz
        x, y = x0 + rx, y0 + ry
        height, slope_x, slope_y, row, column = ground_at(heights, cell, origin, x, y)
        made_of = material[row, column]
        for i in range(n_nearby):
            s = nearby[i]
            slab_height, slab_slope_x, slab_slope_y = _slab_at(slabs, s, x, y)
            if slab_height > height:
                height, slope_x, slope_y = slab_height, slab_slope_x, slab_slope_y
                made_of = slab_material
        if z0 + rz >= height:
            continue
        up = 1.0 / math.sqrt(1.0 + slope_x * slope_x + slope_y * slope_y)
        touched[n, 0], touched[n, 1], touched[n, 2], touched[n, 3] = k, rx, ry, rz
        touched[n, 4] = (z0 + rz - height) * up
        touched[n, 5], touched[n, 6], touched[n, 7] = -slope_x * up, -slope_y * up, up
        touched[n, 8] = made_of
        n += 1
    return n


@kernel
def _slab_at(slabs: Any, k: int, x: float, y: float) -> Any:
    """Height and slope along x and y of a slab at a point; -inf where it is not."""
    dx, dy, c, s = x - slabs[k, 0], y - slabs[k, 1], slabs[k, 2], slabs[k, 3]
    own_x, own_y = c * dx + s * dy, c * dy - s * dx
    inside_x, inside_y = slabs[k, 4] - abs(own_x), slabs[k, 5] - abs(own_y)
    inside, bevel, slope = min(inside_x, inside_y), slabs[k, 7], slabs[k, 8]
    if inside <= 0:
        return -np.inf, 0.0, 0.0
    if inside >= bevel:
        return slabs[k, 6], 0.0, 0.0
    height = slabs[k, 6] - slope * (bevel - inside)
    if inside_x < inside_y:
        fall = slope if own_x > 0 else -slope
        return height, -fall * c, -fall * s
    fall = slope if own_y > 0 else -slope
    return height, fall * s, -fall * c
