"""How a rigid body of our own moves under a wrench."""

import math
from typing import Any

from grouser.envs.simulation.tracks import GRAVITY
from grouser.kernels import kernel


@kernel
def move(state: Any, R: Any, wrench: Any, mass: float, inertia: Any, dt: float) -> None:
    """Newton's and Euler's equations over dt: velocities first, then the pose with them.

    Args:
        state: in and out, (13,) as `ground_wrench` has it.
        R: (3, 3) its rotation before.
        inertia: (3,) about the robot's axes, kg m^2.
    """
    for c in range(3):
        state[7 + c] += dt * wrench[c] / mass
    state[9] -= dt * GRAVITY
    w0 = R[0, 0] * state[10] + R[1, 0] * state[11] + R[2, 0] * state[12]
    w1 = R[0, 1] * state[10] + R[1, 1] * state[11] + R[2, 1] * state[12]
    w2 = R[0, 2] * state[10] + R[1, 2] * state[11] + R[2, 2] * state[12]
    t0 = R[0, 0] * wrench[3] + R[1, 0] * wrench[4] + R[2, 0] * wrench[5]
    t1 = R[0, 1] * wrench[3] + R[1, 1] * wrench[4] + R[2, 1] * wrench[5]
    t2 = R[0, 2] * wrench[3] + R[1, 2] * wrench[4] + R[2, 2] * wrench[5]
    n0 = w0 + dt * (t0 - (inertia[2] - inertia[1]) * w1 * w2) / inertia[0]
    n1 = w1 + dt * (t1 - (inertia[0] - inertia[2]) * w2 * w0) / inertia[1]
    n2 = w2 + dt * (t2 - (inertia[1] - inertia[0]) * w0 * w1) / inertia[2]
    for c in range(3):
        state[10 + c] = R[c, 0] * n0 + R[c, 1] * n1 + R[c, 2] * n2
        state[c] += dt * state[7 + c]
    _turn(state, dt)


@kernel
def _turn(state: Any, dt: float) -> None:
    """Turn the quaternion by the angular rate over dt (exponential map)."""
    wx, wy, wz = state[10], state[11], state[12]
    angle = dt * math.sqrt(wx * wx + wy * wy + wz * wz)
    half_sinc = 0.5 * dt * (math.sin(angle / 2) / (angle / 2) if angle > 1e-8 else 1.0)
    a, b, c, d = half_sinc * wx, half_sinc * wy, half_sinc * wz, math.cos(angle / 2)
    x, y, z, w = state[3], state[4], state[5], state[6]
    x, y, z, w = (
        d * x + a * w + b * z - c * y,
        d * y + b * w + c * x - a * z,
        d * z + c * w + a * y - b * x,
        d * w - a * x - b * y - c * z,
    )
    norm = math.sqrt(x * x + y * y + z * z + w * w)
    state[3], state[4], state[5], state[6] = x / norm, y / norm, z / norm, w / norm
