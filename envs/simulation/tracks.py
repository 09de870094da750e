"""The forces of two tracks on flat ground: a brush model with Janosi and Hanamoto's shear law.

Each track touches the ground in patches. The soil under a patch is sheared elastically by z, which
grows with the slip velocity s and is carried rearwards with the track's shoes, so that fresh shoes
enter the ground at the front with none:

    dz/dt = s - |s| z / K,        tangential force = -mu N z / K

Sheared one way by x from rest, this gives mu N (1 - exp(-x / K)), the law of Janosi and Hanamoto
(1961; Wong, Theory of Ground Vehicles, ch. 2); sheared back, it loses the energy that soil loses
(Dahl 1968), where the law read as a function of x would give it all back and leave the robot
swinging. N is carried by a spring and a damper. That a tracked robot turns less than its tracks say
is a result of this, not an input.
"""

import math
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from grouser.geometry import Array
from grouser.kernels import kernel

GRAVITY: Final = 9.81
"""m/s^2"""

_SHEAR_DAMPING: Final = 0.3
"""Damping ratio of the elastic part of the shear, which dies out as the patch breaks away."""


@dataclass(frozen=True, slots=True)
class TrackModel:
    """Two equal tracks, and the ground that they run on."""

    gauge: float = 0.40
    """Distance between the centre lines, m."""
    width: float = 0.08
    """Width of one track, m."""
    contact_length: float = 0.50
    """Length on the ground, m."""
    friction: float = 0.8
    """mu, between track and ground."""
    shear_modulus: float = 0.003
    """K, the shear from rest after which 63 % of the friction acts, m."""
    sinkage: float = 0.004
    """How far the ground gives under the robot's weight at rest, m."""
    damping_ratio: float = 0.5
    """Of the ground, up and down."""
    n_patches: int = 8
    """Patches of one track along the contact length."""
    approach: tuple[tuple[float, float], ...] = ((0.035, 0.012), (0.065, 0.050))
    """Raised patches beyond either end: how far beyond and how high above the sole, m. They bear
    only when the robot pitches."""

    def patches(self) -> tuple[Array, Array]:
        """Along (n,) and above (n,) of one track's patches, m, from the middle of its sole, the
        rearmost first."""
        half = self.contact_length / 2
        beyond, above = np.array(self.approach).T
        flat = np.linspace(-half, half, self.n_patches)
        x = np.concatenate([-half - beyond[::-1], flat, half + beyond])
        return x, np.concatenate([above[::-1], np.zeros(self.n_patches), above])

    def ground_stiffness(self, mass: float) -> tuple[float, float]:
        """Spring [N/m] and damper [N s/m] under each patch."""
        n = 2 * self.n_patches
        spring = mass * GRAVITY / n / self.sinkage
        return spring, self.damping_ratio * 2 * math.sqrt(spring * mass / n)


@kernel
def track_wrench(
    state: Any,
    track_speed: Any,
    patch_x: Any,
    patch_z: Any,
    half_gauge: float,
    friction: float,
    shear_modulus: float,
    spring: float,
    damper: float,
    spacing: float,
    dt: float,
    shear: Any,
    wrench: Any,
) -> None:
    """Force and torque of the ground on the robot; carries the shear on by dt.

    Args:
        state: (13,) centre of mass [m], quaternion x y z w, velocity [m/s], angular rate [rad/s],
            all in the world frame; the ground is the plane z = 0.
        track_speed: (2,) left and right, m/s, positive forwards.
        patch_x, patch_z: (n,) of one track's patches from the centre of mass, m.
        spacing: between neighbouring patches, m.
        shear: in and out, (2, n, 2) elastic shear under each patch, along and across its track, m.
        wrench: out, (6,) force [N] and torque about the centre of mass [N m], world frame.
    """
    wrench[:] = 0.0
    n = patch_x.shape[0]
    for side in range(2):
        u = track_speed[side]
        y = half_gauge if side == 0 else -half_gauge
        carried = min(1.0, abs(u) * dt / spacing)
        for step in range(n):
            # From the end where shoes leave to the one where they enter, so that the upstream
            # neighbour is still that of the last step.
            k = step if u >= 0 else n - 1 - step
            upstream = k + 1 if u >= 0 else k - 1
            z0, z1 = 0.0, 0.0
            if 0 <= upstream < n:
                z0, z1 = shear[side, upstream, 0], shear[side, upstream, 1]
            z0 = shear[side, k, 0] + carried * (z0 - shear[side, k, 0])
            z1 = shear[side, k, 1] + carried * (z1 - shear[side, k, 1])
            shear[side, k, 0], shear[side, k, 1] = _patch(
                state, patch_x[k], y, patch_z[k], u, friction, shear_modulus, spring, damper, dt,
                z0, z1, wrench,
            )  # fmt: skip


@kernel
def _patch(
    state: Any,
    x: float,
    y: float,
    z: float,
    u: float,
    friction: float,
    shear_modulus: float,
    spring: float,
    damper: float,
    dt: float,
    z0: float,
    z1: float,
    wrench: Any,
) -> Any:
    """Add one patch's force to the wrench; the new shear under it."""
    rx, ry, rz = _rotate(state, x, y, z)
    gap = state[2] + rz
    vx = state[7] + state[11] * rz - state[12] * ry
    vy = state[8] + state[12] * rx - state[10] * rz
    vz = state[9] + state[10] * ry - state[11] * rx
    normal = -spring * gap - damper * vz
    if gap >= 0 or normal <= 0:
        return 0.0, 0.0
    fx, fy, _ = _rotate(state, 1.0, 0.0, 0.0)  # along the track, on the ground
    length = math.sqrt(fx * fx + fy * fy)
    fx, fy = fx / length, fy / length
    slip0, slip1 = vx * fx + vy * fy - u, -vx * fy + vy * fx
    # The law's exact solution for a slip that is constant over dt.
    sheared = dt * math.sqrt(slip0 * slip0 + slip1 * slip1) / shear_modulus
    kept = math.exp(-sheared)
    gained = dt * ((1 - kept) / sheared if sheared > 1e-9 else 1.0)
    z0, z1 = kept * z0 + gained * slip0, kept * z1 + gained * slip1
    holding = max(0.0, 1 - math.sqrt(z0 * z0 + z1 * z1) / shear_modulus)
    pull = friction * normal / shear_modulus
    drag = 2 * _SHEAR_DAMPING * normal * math.sqrt(friction / (shear_modulus * GRAVITY)) * holding
    along, across = -pull * z0 - drag * slip0, -pull * z1 - drag * slip1
    most, tangential = friction * normal, math.sqrt(along * along + across * across)
    if tangential > most:
        along, across = along * most / tangential, across * most / tangential
    force_x, force_y = along * fx - across * fy, along * fy + across * fx
    wrench[0] += force_x
    wrench[1] += force_y
    wrench[2] += normal
    wrench[3] += ry * normal - rz * force_y
    wrench[4] += rz * force_x - rx * normal
    wrench[5] += rx * force_y - ry * force_x
    return z0, z1


@kernel
def _rotate(state: Any, x: float, y: float, z: float) -> Any:
    """A vector of the robot in the world frame, by the state's quaternion."""
    a, b, c, w = state[3], state[4], state[5], state[6]
    tx, ty, tz = 2 * (b * z - c * y), 2 * (c * x - a * z), 2 * (a * y - b * x)
    return (
        x + w * tx + b * tz - c * ty,
        y + w * ty + c * tx - a * tz,
        z + w * tz + a * ty - b * tx,
    )
