"""The planar part of a motion, (turn, chord, side) as in `visual.motion`, and as a pose."""

import math

import numpy as np

from grouser.geometry import Array
from grouser.kernels import kernel, kernel_using


@kernel
def pose_motion(pose: Array) -> Array:
    """(turn, chord, side) of a pose (x, y, heading)."""
    c, s = math.cos(pose[2] / 2), math.sin(pose[2] / 2)
    return np.array([pose[2], c * pose[0] + s * pose[1], -s * pose[0] + c * pose[1]])


@kernel_using(pose_motion)
def pose_to_motion(pose: Array) -> Array:
    """(3, 3) derivative of (turn, chord, side) with respect to the pose (x, y, heading)."""
    c, s = math.cos(pose[2] / 2), math.sin(pose[2] / 2)
    _, chord, side = pose_motion(pose)
    return np.array([[0.0, 0.0, 1.0], [c, s, side / 2], [-s, c, -chord / 2]])


@kernel
def planar_pose(motion: Array) -> tuple[Array, Array]:
    """Pose (3,) of a motion whose first three numbers are turn, chord and side, and its derivative
    (3, 3) by these."""
    turn, chord, side = motion[0], motion[1], motion[2]
    c, s = math.cos(turn / 2), math.sin(turn / 2)
    x, y = c * chord - s * side, s * chord + c * side
    return np.array([x, y, turn]), np.array([[-y / 2, c, -s], [x / 2, s, c], [1.0, 0.0, 0.0]])
