"""The forces of the ground on the robot: a brush model with Janosi and Hanamoto's shear law.

Each track touches the ground in patches. The soil under a patch is sheared elastically by z, which
grows with the slip velocity s and is carried rearwards with the track's shoes, so that fresh shoes
enter the ground at the front with none:

    dz/dt = s - |s| z / K,        tangential force = -mu N z / K

Sheared one way by x from rest, this gives mu N (1 - exp(-x / K)), the law of Janosi and Hanamoto
(1961; Wong, Theory of Ground Vehicles, ch. 2); sheared back, it loses the energy that soil loses
(Dahl 1968), where the law read as a function of x would give it all back and leave the robot
swinging. N is carried by a spring and a damper along the surface's normal. mu, K and the motion
resistance are those of the material under the patch. That a tracked robot turns less than its
tracks say is a result of this, not an input.

The hull touches the ground by the same law, in points whose surface does not move, so that a robot
can be stuck on a ridge, and one that tips over comes to lie on the ground.
"""

import math
from typing import Any, Final, NamedTuple

import numpy as np

from grouser.envs.simulation.robot_model import RobotModel
from grouser.envs.simulation.surface import surface_under
from grouser.envs.simulation.tracks import GRAVITY
from grouser.kernels import kernel, kernel_using

_SHEAR_DAMPING: Final = 0.3
"""Damping ratio of the elastic part of the shear, which dies out as the patch breaks away."""
_CREEP: Final = 0.02
"""Below this speed motion resistance fades: it holds nobody, shear does. m/s"""
_HULL_SINKAGE: Final = 0.005
"""How far a corner of the hull sinks in under a quarter of the weight, m."""
_HULL_DAMPING_RATIO: Final = 0.5
_MARGIN: Final = 0.2
"""What a robot moves in 0.1 s at 2 m/s, m."""


class Law(NamedTuple):
    """What the law needs to know of a robot, as kernels read it. It touches the ground in m points:
    the n patches of the left track, those of the right one, then points of the hull."""

    points: Any
    """(m, 3) from the centre of mass, m; along a track the rearmost first."""
    part: Any
    """(m,) 0 on the left track, 1 on the right one, 2 on the hull."""
    contact: Any
    """(n,) the contact of the track, or of its wheel, that each patch belongs to."""
    spacing: float
    """Between neighbouring patches, m."""
    stiffness: Any
    """(3, 2) spring [N/m] and damper [N s/m] under a point of each part."""
    lateral: Any
    """(3,) factor of the force across the part."""
    rutting: Any
    """(3,) share of the material's motion resistance that the part feels: 1 for a track, which
    presses a rut, 0 for the hull."""
    reach: float
    """Nothing further off than this can be touched within 0.1 s, m."""

    @staticmethod
    def of(model: RobotModel) -> "Law":
        """The law of a robot."""
        tracks = model.tracks
        x, above, contact = tracks.patches()
        z = above - tracks.sinkage
        sides = [np.column_stack([x, np.full_like(x, y), z]) for y in (0.5, -0.5)]
        points = np.concatenate([*sides, model.hull_points()])
        points[: 2 * len(x), 1] *= tracks.gauge
        points[:, 2] -= model.com_height
        hull_spring = model.mass * GRAVITY / 4 / _HULL_SINKAGE
        hull_damper = _HULL_DAMPING_RATIO * 2 * math.sqrt(hull_spring * model.mass / 4)
        ground = tracks.ground_stiffness(model.mass)
        return Law(
            points,
            np.repeat([0, 1, 2], [len(x), len(x), len(points) - 2 * len(x)]),
            contact,
            tracks.spacing,
            np.array([ground, ground, (hull_spring, hull_damper)]),
            np.array([tracks.lateral_factor, tracks.lateral_factor, 1.0]),
            np.array([1.0, 1.0, 0.0]),
            float(np.linalg.norm(points, axis=1).max()) + _MARGIN,
        )


@kernel
def rotation_of(state: Any, R: Any) -> None:
    """Write into R (3, 3) the rotation of a state's unit quaternion."""
    x, y, z, w = state[3], state[4], state[5], state[6]
    R[0, 0], R[0, 1], R[0, 2] = 1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)
    R[1, 0], R[1, 1], R[1, 2] = 2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)
    R[2, 0], R[2, 1], R[2, 2] = 2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)


@kernel_using(surface_under)
def ground_wrench(
    state: Any, R: Any, track_speed: Any, traction: Any, law: Any, surface: Any, nearby: Any,
    n_nearby: int, top: float, dt: float, shear: Any, touched: Any, wrench: Any,
) -> None:  # fmt: skip
    """Force and torque of the ground on the robot; carries the shear on by dt.

    Args:
        state: (13,) centre of mass [m], quaternion x y z w, velocity [m/s], angular rate [rad/s],
            all in the world frame.
        R: (3, 3) its rotation.
        track_speed: (2,) left and right, m/s, positive forwards.
        traction: (2,) share of the force along each track that its belt passes on.
        law, surface: of the robot and of the world.
        nearby, n_nearby, top: what `look_around` found.
        dt: s.
        shear: in and out, (m, 2) elastic shear under each point, along and across, m.
        touched: scratch, (m, 9).
        wrench: out, (6,) force [N] and torque about the centre of mass [N m], world frame.
    """
    _carry(shear, law.contact, track_speed, dt / law.spacing)
    n = surface_under(state, R, law.points, surface, nearby, n_nearby, top, touched)
    _press(
        state, R, touched, n, law.part, track_speed, traction, law.stiffness, law.lateral,
        law.rutting, surface.table, dt, shear, wrench,
    )  # fmt: skip


@kernel
def _carry(shear: Any, contact: Any, track_speed: Any, per_metre: float) -> None:
    """Shoes carry the shear under them on: what lay upstream comes in."""
    n = contact.shape[0]
    for side in range(2):
        u = track_speed[side]
        share = min(1.0, abs(u) * per_metre)
        for step in range(n):
            # From the end where shoes leave to the one where they enter, so that the upstream
            # neighbour is still that of the last step.
            k = step if u >= 0 else n - 1 - step
            upstream = k + 1 if u >= 0 else k - 1
            fed = 0 <= upstream < n and contact[upstream] == contact[k]
            for c in range(2):
                entering = shear[side * n + upstream, c] if fed else 0.0
                shear[side * n + k, c] += share * (entering - shear[side * n + k, c])


@kernel
def _press(
    state: Any, R: Any, touched: Any, n: int, part: Any, track_speed: Any, traction: Any,
    stiffness: Any, lateral: Any, rutting: Any, table: Any, dt: float, shear: Any, wrench: Any,
) -> None:  # fmt: skip
    """Shear the soil under the n touched points and sum the forces; free points lose theirs."""
    wrench[:] = 0.0
    freed = 0
    for i in range(n):
        k = int(touched[i, 0])
        while freed < k:
            shear[freed, 0] = shear[freed, 1] = 0.0
            freed += 1
        freed = k + 1
        rx, ry, rz = touched[i, 1], touched[i, 2], touched[i, 3]
        gap, nx, ny, nz = touched[i, 4], touched[i, 5], touched[i, 6], touched[i, 7]
        made_of, side = int(touched[i, 8]), part[k]
        vx = state[7] + state[11] * rz - state[12] * ry
        vy = state[8] + state[12] * rx - state[10] * rz
        vz = state[9] + state[10] * ry - state[11] * rx
        normal = -stiffness[side, 0] * gap - stiffness[side, 1] * (vx * nx + vy * ny + vz * nz)
        if normal <= 0:
            shear[k, 0] = shear[k, 1] = 0.0
            continue
        u, passed_on = 0.0, 1.0
        if side < 2:
            u, passed_on = track_speed[side], traction[side]
        fx, fy, fz = _along_surface(R, nx, ny, nz)
        lx, ly, lz = ny * fz - nz * fy, nz * fx - nx * fz, nx * fy - ny * fx
        v0, v1 = vx * fx + vy * fy + vz * fz, vx * lx + vy * ly + vz * lz
        z0, z1, along, across = _shear_force(
            v0 - u, v1, shear[k, 0], shear[k, 1], normal, table[made_of, 0], table[made_of, 1], dt
        )
        shear[k, 0], shear[k, 1] = z0, z1
        resistance = rutting[side] * table[made_of, 2] * normal
        along = passed_on * along - resistance * v0 / math.sqrt(v0 * v0 + _CREEP * _CREEP)
        across *= lateral[side]
        force_x = normal * nx + along * fx + across * lx
        force_y = normal * ny + along * fy + across * ly
        force_z = normal * nz + along * fz + across * lz
        wrench[0] += force_x
        wrench[1] += force_y
        wrench[2] += force_z
        wrench[3] += ry * force_z - rz * force_y
        wrench[4] += rz * force_x - rx * force_z
        wrench[5] += rx * force_y - ry * force_x
    shear[freed:] = 0.0


@kernel
def _shear_force(
    slip0: float, slip1: float, z0: float, z1: float, normal: float, friction: float,
    modulus: float, dt: float,
) -> Any:  # fmt: skip
    """The shear after dt of a slip along and across [m/s], and the force in both directions [N]."""
    # The law's exact solution for a slip that is constant over dt.
    sheared = dt * math.sqrt(slip0 * slip0 + slip1 * slip1) / modulus
    kept = math.exp(-sheared)
    gained = dt * ((1 - kept) / sheared if sheared > 1e-9 else 1.0)
    z0, z1 = kept * z0 + gained * slip0, kept * z1 + gained * slip1
    holding = max(0.0, 1 - math.sqrt(z0 * z0 + z1 * z1) / modulus)
    pull = friction * normal / modulus
    drag = 2 * _SHEAR_DAMPING * normal * math.sqrt(friction / (modulus * GRAVITY)) * holding
    along, across = -pull * z0 - drag * slip0, -pull * z1 - drag * slip1
    most, tangential = friction * normal, math.sqrt(along * along + across * across)
    if tangential > most:
        along, across = along * most / tangential, across * most / tangential
    return z0, z1, along, across


@kernel
def _along_surface(R: Any, nx: float, ny: float, nz: float) -> Any:
    """The robot's forward axis laid on a surface; its upward one where it stands on its end."""
    fx, fy, fz = R[0, 0], R[1, 0], R[2, 0]
    up = fx * nx + fy * ny + fz * nz
    if abs(up) > 0.999:
        fx, fy, fz = R[0, 2], R[1, 2], R[2, 2]
        up = fx * nx + fy * ny + fz * nz
    fx, fy, fz = fx - up * nx, fy - up * ny, fz - up * nz
    length = math.sqrt(fx * fx + fy * fy + fz * fz)
    return fx / length, fy / length, fz / length
