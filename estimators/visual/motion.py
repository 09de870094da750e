"""How chassis motion moves a point in disparity space, singularity-free (SPEC 1.6).

A point is w = (u [px], v [px], d [px]) in the left image of a rectified pair. The motion of the
chassis from the reference frame to the current one is the 6-vector

    (turn [rad], chord [m], side [m], height [m], roll [rad], pitch [rad])

`turn` and `chord` are the paper's theta and rho; `side` is the part of the track centre's
displacement across the half-angle frame, zero under the non-holonomic constraint; the last three
are what a planar robot would not have. The current pose in the reference frame is

    R = Rz(turn) Ry(pitch) Rx(roll),   t = Rz(turn / 2) (chord, side, 0) + (0, 0, height).

With ray = ((u - cx) / fx, (v - cy) / fy, 1) and inverse depth i = d / (fx baseline), the ray in
the current camera is A @ ray + b * i: linear, valid at d = 0, and nothing is divided by d.
"""

import math

import numpy as np

from grouser.geometry import Array
from grouser.kernels import kernel
from grouser.rig import StereoCamera

TURN, CHORD, SIDE, HEIGHT, ROLL, PITCH = range(6)


def intrinsics(camera: StereoCamera) -> Array:
    """(5,) fx, fy, cx, cy [px], baseline [m]: a camera as the kernels take it."""
    return np.array([camera.fx, camera.fy, camera.cx, camera.cy, camera.baseline])


@kernel
def chassis_pose(planar: Array, height: float, roll: float, pitch: float) -> Array:
    """T (4, 4) of the chassis after a motion whose planar part is the pose (3,)."""
    T = np.eye(4)
    _rotation(planar[2], roll, pitch, T)
    T[0, 3], T[1, 3], T[2, 3] = planar[0], planar[1], height
    return T


@kernel
def _rotation(turn: float, roll: float, pitch: float, R: Array) -> None:
    """Write Rz(turn) Ry(pitch) Rx(roll) into the first three rows and columns."""
    ct, st = math.cos(turn), math.sin(turn)
    cr, sr = math.cos(roll), math.sin(roll)
    cp, sp = math.cos(pitch), math.sin(pitch)
    R[0, 0], R[0, 1], R[0, 2] = ct * cp, ct * sp * sr - st * cr, ct * sp * cr + st * sr
    R[1, 0], R[1, 1], R[1, 2] = st * cp, st * sp * sr + ct * cr, st * sp * cr - ct * sr
    R[2, 0], R[2, 1], R[2, 2] = -sp, cp * sr, cp * cr


@kernel
def _product(a: Array, b: Array, transpose_a: bool, out: Array) -> None:
    for i in range(3):
        for j in range(b.shape[1]):
            total = 0.0
            for k in range(3):
                total += (a[k, i] if transpose_a else a[i, k]) * b[k, j]
            out[i, j] = total


@kernel
def _chassis_pose(motion: Array, R: Array, t: Array, dR: Array, dt: Array) -> None:
    """Rotation (3, 3) and translation (3,) of the chassis, with derivatives by the six numbers."""
    ct, st = math.cos(motion[0]), math.sin(motion[0])
    ch, sh = math.cos(motion[0] / 2), math.sin(motion[0] / 2)
    cr, sr = math.cos(motion[4]), math.sin(motion[4])
    cp, sp = math.cos(motion[5]), math.sin(motion[5])
    chord, side = motion[1], motion[2]
    _rotation(motion[0], motion[4], motion[5], R)
    t[0], t[1], t[2] = ch * chord - sh * side, sh * chord + ch * side, motion[3]
    dR[:] = 0.0
    dt[:] = 0.0
    for j in range(3):
        dR[0, 0, j], dR[0, 1, j] = -R[1, j], R[0, j]
    for i in range(3):
        dR[4, i, 1], dR[4, i, 2] = R[i, 2], -R[i, 1]
    dR[5, 0, 0], dR[5, 0, 1], dR[5, 0, 2] = -ct * sp, ct * cp * sr, ct * cp * cr
    dR[5, 1, 0], dR[5, 1, 1], dR[5, 1, 2] = -st * sp, st * cp * sr, st * cp * cr
    dR[5, 2, 0], dR[5, 2, 1], dR[5, 2, 2] = -cp, -sp * sr, -sp * cr
    dt[0, 0], dt[0, 1] = -t[1] / 2, t[0] / 2
    dt[1, 0], dt[1, 1] = ch, sh
    dt[2, 0], dt[2, 1] = -sh, ch
    dt[3, 2] = 1.0


@kernel
def camera_motion(motion: Array, T_base_camera: Array) -> tuple[Array, Array, Array, Array]:
    """A (3, 3), b (3,) of the module's formula and their derivatives dA (6, 3, 3), db (6, 3)."""
    R, t = np.empty((3, 3)), np.empty(3)
    dR, dt = np.empty((6, 3, 3)), np.empty((6, 3))
    _chassis_pose(motion, R, t, dR, dt)
    M = T_base_camera[:3, :3].copy()
    mount = T_base_camera[:3, 3].copy()
    A, b = np.empty((3, 3)), np.empty(3)
    dA, db = np.empty((6, 3, 3)), np.empty((6, 3))
    buffer = np.empty((3, 3))
    column, turned = np.empty((3, 1)), np.empty((3, 1))

    _product(R, M, True, buffer)
    _product(M, buffer, True, A)
    column[:, 0] = mount - t
    _product(R, column, True, turned)
    column[:, 0] = turned[:, 0] - mount
    _product(M, column, True, turned)
    b[:] = turned[:, 0]
    for k in range(6):
        _product(dR[k], M, True, buffer)
        _product(M, buffer, True, dA[k])
        column[:, 0] = mount - t
        _product(dR[k], column, True, turned)
        for i in range(3):
            column[i, 0] = turned[i, 0] - (
                R[0, i] * dt[k, 0] + R[1, i] * dt[k, 1] + R[2, i] * dt[k, 2]
            )
        _product(M, column, True, turned)
        db[k] = turned[:, 0]
    return A, b, dA, db


@kernel
def measure(
    w: Array,
    A: Array,
    b: Array,
    dA: Array,
    db: Array,
    camera: Array,
    p: Array,
    Jw: Array,
    Jm: Array,
) -> bool:
    """Where point w is seen after the motion: p (3,), with dp/dw (3, 3) and dp/dmotion (3, 6).

    False where the point falls behind the camera.
    """
    fx, fy, cx, cy = camera[0], camera[1], camera[2], camera[3]
    x, y = (w[0] - cx) / fx, (w[1] - cy) / fy
    i = w[2] / (fx * camera[4])
    X = A[0, 0] * x + A[0, 1] * y + A[0, 2] + b[0] * i
    Y = A[1, 0] * x + A[1, 1] * y + A[1, 2] + b[1] * i
    Z = A[2, 0] * x + A[2, 1] * y + A[2, 2] + b[2] * i
    if Z < 1e-6:
        return False
    u, v, d = fx * X / Z, fy * Y / Z, w[2] / Z
    p[0], p[1], p[2] = u + cx, v + cy, d
    for k in range(3):
        scale = 1 / fx if k == 0 else (1 / fy if k == 1 else 1 / (fx * camera[4]))
        gx = (A[0, k] if k < 2 else b[0]) * scale
        gy = (A[1, k] if k < 2 else b[1]) * scale
        gz = (A[2, k] if k < 2 else b[2]) * scale
        Jw[0, k] = (fx * gx - u * gz) / Z
        Jw[1, k] = (fy * gy - v * gz) / Z
        Jw[2, k] = ((1.0 if k == 2 else 0.0) - d * gz) / Z
    for k in range(6):
        gx = dA[k, 0, 0] * x + dA[k, 0, 1] * y + dA[k, 0, 2] + db[k, 0] * i
        gy = dA[k, 1, 0] * x + dA[k, 1, 1] * y + dA[k, 1, 2] + db[k, 1] * i
        gz = dA[k, 2, 0] * x + dA[k, 2, 1] * y + dA[k, 2, 2] + db[k, 2] * i
        Jm[0, k] = (fx * gx - u * gz) / Z
        Jm[1, k] = (fy * gy - v * gz) / Z
        Jm[2, k] = -d * gz / Z
    return True


@kernel
def predict_points(
    points: Array,
    motion: Array,
    motion_covariance: Array,
    T_base_camera: Array,
    camera: Array,
    noise: Array,
) -> tuple[Array, Array, Array]:
    """Where reference points are expected now, and how surely (SPEC 1.5, step 2).

    Args: points (n, 3), motion (6,), motion_covariance (6, 6), noise (6,) the variances
    of u, v, d in the reference and in the current frame [px^2].
    Returns: predicted (n, 3), its covariance (n, 3, 3), its derivative (n, 3, 3) by the reference
    point; NaN behind the camera.
    """
    A, b, dA, db = camera_motion(motion, T_base_camera)
    n = points.shape[0]
    predicted, covariance = np.empty((n, 3)), np.empty((n, 3, 3))
    by_point = np.full((n, 3, 3), np.nan)
    Jm, JC = np.empty((3, 6)), np.empty((3, 6))
    for i in range(n):
        Jw = by_point[i]
        if not measure(points[i], A, b, dA, db, camera, predicted[i], Jw, Jm):
            predicted[i] = np.nan
            covariance[i] = np.nan
            continue
        for r in range(3):
            for c in range(6):
                total = 0.0
                for k in range(6):
                    total += Jm[r, k] * motion_covariance[k, c]
                JC[r, c] = total
        for r in range(3):
            for c in range(3):
                total = noise[3 + r] if r == c else 0.0
                for k in range(3):
                    total += Jw[r, k] * noise[k] * Jw[c, k]
                for k in range(6):
                    total += JC[r, k] * Jm[c, k]
                covariance[i, r, c] = total
    return predicted, covariance, by_point
