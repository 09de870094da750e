"""What pushes the hull of our own rigid body out of boxes and cylinders.

Solid things push with a stiff spring and a damper where the hull has entered them, against the face
that it entered by, and rub: penalty contacts. Points that may enter are the hull's corners, a box's
upright edges, and what of the hull is nearest to a cylinder's axis.
"""

import math
from typing import Any, Final, NamedTuple

import numpy as np

from grouser.envs.simulation.world import World
from grouser.kernels import kernel

_STIFFNESS: Final = 1e3
"""Of a contact, N/m per kg of the robot: at full speed it enters by about 1 cm."""
_DAMPING: Final = 25.0
"""Of a contact, N s/m per kg of the robot."""
_FRICTION: Final = 0.15
"""Of the hull on solid things, as Bullet's."""
_CREEP: Final = 0.02
"""Below this sliding speed friction fades, m/s."""
_TOP_PREFERENCE: Final = 3.0
"""A box pushes upwards only where its top is this much nearer than a side: robots drive into things
more often than they fall on them."""


class Obstacles(NamedTuple):
    """A world's solid things as kernels read them."""

    boxes: Any
    """(n, 8): centre, half extents, cosine and sine of the yaw."""
    cylinders: Any
    """(m, 5): centre, radius, half height."""

    @staticmethod
    def of(world: World) -> "Obstacles":
        """Those of a world."""
        s, c = world.solids, world.cylinders
        return Obstacles(
            np.column_stack([s.centre, s.half_extents, np.cos(s.yaw), np.sin(s.yaw)]),
            np.column_stack([c.centre, c.radius, c.half_height]),
        )


@kernel
def obstacles_around(
    obstacles: Any, x: float, y: float, reach: float, boxes: Any, cylinders: Any
) -> Any:
    """How many boxes and cylinders are within reach [m] of a point; their indices in the arrays."""
    n, m = 0, 0
    for k in range(obstacles.boxes.shape[0]):
        box = obstacles.boxes[k]
        dx, dy = x - box[0], y - box[1]
        if (
            abs(box[6] * dx + box[7] * dy) < box[3] + reach
            and abs(box[6] * dy - box[7] * dx) < box[4] + reach
        ):
            boxes[n] = k
            n += 1
    for k in range(obstacles.cylinders.shape[0]):
        cylinder = obstacles.cylinders[k]
        if math.hypot(x - cylinder[0], y - cylinder[1]) < cylinder[3] + reach:
            cylinders[m] = k
            m += 1
    return n, m


@kernel
def hull_wrench(
    state: Any, R: Any, mass: float, centre: Any, half: Any, obstacles: Any, boxes: Any,
    n_boxes: int, cylinders: Any, n_cylinders: int, wrench: Any,
) -> int:  # fmt: skip
    """Add to the wrench what solid things push the hull with; the number of points where they do.

    Args:
        centre, half: (3,) of the hull, from the centre of mass along the robot's axes, m.
        boxes, cylinders: those that may be touched, so many of them.
    """
    contacts = 0
    for i in range(n_boxes):
        box = obstacles.boxes[boxes[i]]
        contacts += _corners_in_box(state, R, mass, centre, half, box, wrench)
        contacts += _box_edges_in_hull(state, R, mass, centre, half, box, wrench)
    for i in range(n_cylinders):
        cylinder = obstacles.cylinders[cylinders[i]]
        contacts += _cylinder_at_hull(state, R, mass, centre, half, cylinder, wrench)
    return contacts


@kernel
def _corners_in_box(
    state: Any, R: Any, mass: float, centre: Any, half: Any, box: Any, wrench: Any
) -> int:
    contacts = 0
    for corner in range(8):
        x = centre[0] + (half[0] if corner & 1 else -half[0])
        y = centre[1] + (half[1] if corner & 2 else -half[1])
        z = centre[2] + (half[2] if corner & 4 else -half[2])
        rx, ry, rz = _turned(R, x, y, z)
        dx, dy, dz = state[0] + rx - box[0], state[1] + ry - box[1], state[2] + rz - box[2]
        c, s = box[6], box[7]
        own_x, own_y = c * dx + s * dy, c * dy - s * dx
        in_x, in_y, in_z = box[3] - abs(own_x), box[4] - abs(own_y), box[5] - dz
        if in_x <= 0 or in_y <= 0 or in_z <= 0 or dz < -box[5]:
            continue
        contacts += 1
        if _TOP_PREFERENCE * in_z < min(in_x, in_y):
            _push(state, mass, rx, ry, rz, 0.0, 0.0, 1.0, in_z, wrench)
        elif in_x < in_y:
            side = 1.0 if own_x > 0 else -1.0
            _push(state, mass, rx, ry, rz, side * c, side * s, 0.0, in_x, wrench)
        else:
            side = 1.0 if own_y > 0 else -1.0
            _push(state, mass, rx, ry, rz, -side * s, side * c, 0.0, in_y, wrench)
    return contacts


@kernel
def _box_edges_in_hull(
    state: Any, R: Any, mass: float, centre: Any, half: Any, box: Any, wrench: Any
) -> int:
    """The box's upright edges, each in the middle of what of it is inside the hull."""
    contacts = 0
    c, s = box[6], box[7]
    for corner in range(4):
        own_x = box[3] if corner & 1 else -box[3]
        own_y = box[4] if corner & 2 else -box[4]
        dx = box[0] + c * own_x - s * own_y - state[0]
        dy = box[1] + s * own_x + c * own_y - state[1]
        low, high = -box[5], box[5]
        dz = box[2] - state[2]
        for axis in range(3):  # clip the edge by the hull's faces
            at = R[0, axis] * dx + R[1, axis] * dy + R[2, axis] * dz - centre[axis]
            low, high = _clipped(at, R[2, axis], half[axis], low, high)
        if low >= high:
            continue
        rz = dz + (low + high) / 2
        px = R[0, 0] * dx + R[1, 0] * dy + R[2, 0] * rz - centre[0]
        py = R[0, 1] * dx + R[1, 1] * dy + R[2, 1] * rz - centre[1]
        contacts += 1
        _push_by_face(state, R, mass, dx, dy, rz, px, py, half, 0.0, wrench)
    return contacts


@kernel
def _cylinder_at_hull(
    state: Any, R: Any, mass: float, centre: Any, half: Any, cylinder: Any, wrench: Any
) -> int:
    """The point of the hull that is nearest to the axis, at the height where it is."""
    dx, dy, dz = cylinder[0] - state[0], cylinder[1] - state[1], cylinder[2] - state[2]
    qx, qy, qz = _turned(R, centre[0], centre[1], centre[2])
    px, py = 0.0, 0.0
    for _ in range(2):
        rz = min(max(qz, dz - cylinder[4]), dz + cylinder[4])
        px = R[0, 0] * dx + R[1, 0] * dy + R[2, 0] * rz - centre[0]
        py = R[0, 1] * dx + R[1, 1] * dy + R[2, 1] * rz - centre[1]
        pz = R[0, 2] * dx + R[1, 2] * dy + R[2, 2] * rz - centre[2]
        qx, qy, qz = _turned(
            R,
            centre[0] + min(max(px, -half[0]), half[0]),
            centre[1] + min(max(py, -half[1]), half[1]),
            centre[2] + min(max(pz, -half[2]), half[2]),
        )
    if abs(qz - dz) > cylinder[4]:
        return 0
    if abs(px) < half[0] and abs(py) < half[1]:  # a post so thin that its axis is inside the hull
        _push_by_face(state, R, mass, dx, dy, qz, px, py, half, cylinder[3], wrench)
        return 1
    away_x, away_y = qx - dx, qy - dy
    distance = math.hypot(away_x, away_y)
    if distance >= cylinder[3]:
        return 0
    _push(
        state, mass, qx, qy, qz, away_x / distance, away_y / distance, 0.0,
        cylinder[3] - distance, wrench,
    )  # fmt: skip
    return 1


@kernel
def _push_by_face(
    state: Any, R: Any, mass: float, rx: float, ry: float, rz: float, px: float, py: float,
    half: Any, further: float, wrench: Any,
) -> None:  # fmt: skip
    """Push at a point that is in the hull, at px and py from its middle, by the nearest side."""
    axis = 0 if half[0] - abs(px) < half[1] - abs(py) else 1
    at = px if axis == 0 else py
    side = -1.0 if at > 0 else 1.0  # the hull goes the other way
    nx, ny, nz = side * R[0, axis], side * R[1, axis], side * R[2, axis]
    _push(state, mass, rx, ry, rz, nx, ny, nz, half[axis] - abs(at) + further, wrench)


@kernel
def _push(
    state: Any, mass: float, rx: float, ry: float, rz: float, nx: float, ny: float, nz: float,
    depth: float, wrench: Any,
) -> None:  # fmt: skip
    """Add to the wrench a spring, a damper and friction at a point, along a unit normal."""
    vx = state[7] + state[11] * rz - state[12] * ry
    vy = state[8] + state[12] * rx - state[10] * rz
    vz = state[9] + state[10] * ry - state[11] * rx
    out = vx * nx + vy * ny + vz * nz
    force = mass * (_STIFFNESS * depth - _DAMPING * out)
    if force <= 0:
        return
    tx, ty, tz = vx - out * nx, vy - out * ny, vz - out * nz
    rub = _FRICTION * force / math.sqrt(tx * tx + ty * ty + tz * tz + _CREEP * _CREEP)
    fx, fy, fz = force * nx - rub * tx, force * ny - rub * ty, force * nz - rub * tz
    wrench[0] += fx
    wrench[1] += fy
    wrench[2] += fz
    wrench[3] += ry * fz - rz * fy
    wrench[4] += rz * fx - rx * fz
    wrench[5] += rx * fy - ry * fx


@kernel
def _turned(R: Any, x: float, y: float, z: float) -> Any:
    return (
        R[0, 0] * x + R[0, 1] * y + R[0, 2] * z,
        R[1, 0] * x + R[1, 1] * y + R[1, 2] * z,
        R[2, 0] * x + R[2, 1] * y + R[2, 2] * z,
    )


@kernel
def _clipped(at: float, slope: float, half: float, low: float, high: float) -> Any:
    """The part of [low, high] on which |at + slope t| <= half; high <= low for none."""
    if abs(slope) < 1e-12:
        return (low, high) if abs(at) < half else (0.0, 0.0)
    a, b = (-half - at) / slope, (half - at) / slope
    return max(low, min(a, b)), min(high, max(a, b))
