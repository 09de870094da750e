"""SE(2) for one pose at a time, in kernels: `grouser.geometry` is for arrays of them.

A filter composes a handful of poses a frame, and NumPy takes longer to look at three numbers than
a processor takes for the whole update.
"""

import math

import numpy as np

from grouser.geometry import Array
from grouser.kernels import kernel


@kernel
def wrapped(angle: float) -> float:
    """Angle [rad], wrapped to (-pi, pi]."""
    if abs(angle) < math.pi:
        return angle
    turned = math.pi - (math.pi - angle) % (2 * math.pi)
    # A remainder just short of a full turn rounds up to it.
    return math.pi if turned <= -math.pi else turned


@kernel
def compose(a: Array, b: Array) -> Array:
    """Pose b (3,), given in the frame of pose a (3,), expressed in a's parent."""
    c, s = math.cos(a[2]), math.sin(a[2])
    x, y = a[0] + c * b[0] - s * b[1], a[1] + s * b[0] + c * b[1]
    return np.array([x, y, wrapped(a[2] + b[2])])


@kernel
def between(a: Array, b: Array) -> Array:
    """Pose b (3,) seen from pose a (3,)."""
    c, s = math.cos(a[2]), math.sin(a[2])
    x, y = b[0] - a[0], b[1] - a[1]
    return np.array([c * x + s * y, -s * x + c * y, wrapped(b[2] - a[2])])


@kernel
def compose_jacobians(a: Array, b: Array) -> tuple[Array, Array]:
    """Derivatives (3, 3) of compose(a, b) with respect to a and to b."""
    c, s = math.cos(a[2]), math.sin(a[2])
    by_a, by_b = np.eye(3), np.eye(3)
    by_a[0, 2], by_a[1, 2] = -s * b[0] - c * b[1], c * b[0] - s * b[1]
    by_b[0, 0], by_b[0, 1], by_b[1, 0], by_b[1, 1] = c, -s, s, c
    return by_a, by_b


@kernel
def carried(F: Array, P: Array, V: Array, Q: Array) -> Array:
    """F P F^T + V Q V^T: the covariance after a step, of what was before it and of the step."""
    return F @ P @ F.T + V @ Q @ V.T
