"""The two steps of the filter that all errors take part in: the update, and the move of the frame.

In kernels without fastmath, because a threaded BLAS may round differently on another machine.
"""

import math
from dataclasses import replace

import numpy as np

from grouser.estimators.monocular.camera import Innovation, Projection
from grouser.estimators.monocular.state import HEAD, MOTION, POSITION, ROTATION, SlamState
from grouser.estimators.visual.motion import chassis_pose
from grouser.geometry import Array, rotate, skew
from grouser.kernels import kernel

_MOTION, _HEAD = MOTION.start, HEAD


def update(state: SlamState, innovation: Innovation) -> SlamState:
    """The Kalman update with what was measured."""
    change, covariance = _update(
        state.covariance, innovation.cross, innovation.covariance, innovation.residual
    )
    return state.corrected(change, covariance)


def compose(state: SlamState, projection: Projection) -> SlamState:
    """The robot and the points' frame move on to the current image; the motion is done.

    Args:
        projection: of this very state, whose points are all in front of the camera.
    """
    T = state.T_start_base
    R, motion = T[:3, :3], state.motion
    step = motion_pose(motion)
    by_rotation, by_motion = _pose_jacobians(R, step, motion)
    covariance = _compose(
        state.covariance, by_rotation, by_motion, projection.by_point, projection.by_motion
    )
    return replace(
        state,
        T_start_base=_orthonormal(T @ step),
        motion=np.zeros(6),
        points=projection.points,
        covariance=covariance,
    )


def motion_pose(motion: Array) -> Array:
    """T (4, 4) of the chassis after a motion (6,)."""
    along = rotate(motion[0] / 2, motion[1:3])
    T: Array = chassis_pose(np.array([along[0], along[1], motion[0]]), *map(float, motion[3:]))
    return T


def _pose_jacobians(R: Array, step: Array, motion: Array) -> tuple[Array, Array]:
    """Derivatives of the errors (6,) of the pose after a step: by the rotation before it (6, 3),
    and by the motion (6, 6)."""
    turn, chord, side, _, _, pitch = motion
    by_rotation, by_motion = np.zeros((6, 3)), np.zeros((6, 6))
    by_rotation[POSITION] = -skew(R @ step[:3, 3])
    by_rotation[ROTATION] = np.eye(3)
    half = turn / 2
    ch, sh = math.cos(half), math.sin(half)
    along, across = np.array([ch, sh, 0.0]), np.array([-sh, ch, 0.0])
    by_motion[POSITION, 0] = R @ (chord * across - side * along) / 2
    by_motion[POSITION, 1] = R @ along
    by_motion[POSITION, 2] = R @ across
    by_motion[POSITION, 3] = R[:, 2]
    # exp(error) from the left: Rz(turn) Ry(pitch) Rx(roll) turns about z, then y', then x''.
    ct, st, cp, sp = math.cos(turn), math.sin(turn), math.cos(pitch), math.sin(pitch)
    by_motion[ROTATION, 0] = R[:, 2]
    by_motion[ROTATION, 4] = R @ np.array([ct * cp, st * cp, -sp])
    by_motion[ROTATION, 5] = R @ np.array([-st, ct, 0.0])
    return by_rotation, by_motion


def _orthonormal(T: Array) -> Array:
    """T with what rounding has added over thousands of products taken out of its rotation."""
    U, _, Vt = np.linalg.svd(T[:3, :3])
    T = T.copy()
    T[:3, :3] = U @ Vt
    return np.asarray(T)


@kernel
def _update(P: Array, cross: Array, S: Array, residual: Array) -> tuple[Array, Array]:
    """P H^T S^-1 residual, and P - P H^T S^-1 H P by the Cholesky factor of S: it stays symmetric.

    Overwrites `cross` and `S`. Inner loops run along rows, where they can be vectorised.
    """
    rows, size = cross.shape
    change = np.zeros(size)
    whitened = residual.copy()
    for j in range(rows):
        for k in range(j):
            factor = S[j, k]
            whitened[j] -= factor * whitened[k]
            for c in range(size):
                cross[j, c] -= factor * cross[k, c]
        pivot = math.sqrt(S[j, j])
        whitened[j] /= pivot
        for c in range(size):
            cross[j, c] /= pivot
        for i in range(j + 1, rows):
            S[i, j] /= pivot
        for i in range(j + 1, rows):
            factor = S[i, j]
            for k in range(j + 1, i + 1):
                S[i, k] -= factor * S[k, j]
        for c in range(size):
            change[c] += whitened[j] * cross[j, c]
    out = P.copy()
    for i in range(size):
        for j in range(rows):
            factor = cross[j, i]
            for c in range(i, size):
                out[i, c] -= factor * cross[j, c]
        for c in range(i + 1, size):
            out[c, i] = out[i, c]
    return change, out


@kernel
def _compose(
    P: Array, by_rotation: Array, by_motion: Array, point_by_point: Array, point_by_motion: Array
) -> Array:
    """F P F^T of the composition; rows and columns of the motion become zero."""
    half = _carried(P, by_rotation, by_motion, point_by_point, point_by_motion)
    out: Array = _carried(
        np.ascontiguousarray(half.T), by_rotation, by_motion, point_by_point, point_by_motion
    )
    for i in range(out.shape[0]):
        for c in range(i):
            mean = 0.5 * (out[i, c] + out[c, i])
            out[i, c] = out[c, i] = mean
    return out


@kernel
def _carried(
    M: Array, by_rotation: Array, by_motion: Array, point_by_point: Array, point_by_motion: Array
) -> Array:
    """F M: most of F is zero."""
    out = np.zeros_like(M)
    for r in range(6):
        if r < 3:
            out[r] += M[r]
        for c in range(3):
            out[r] += by_rotation[r, c] * M[3 + c]
        for c in range(6):
            out[r] += by_motion[r, c] * M[_MOTION + c]
    out[6:_MOTION] = M[6:_MOTION]
    for i in range(point_by_point.shape[0]):
        for r in range(3):
            row = out[_HEAD + 3 * i + r]
            for c in range(3):
                row += point_by_point[i, r, c] * M[_HEAD + 3 * i + c]
            for c in range(6):
                row += point_by_motion[i, r, c] * M[_MOTION + c]
    return out
