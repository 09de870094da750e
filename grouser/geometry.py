"""Poses: SE(2) as arrays (..., 3) of x [m], y [m], heading [rad]; SE(3) as matrices (..., 4, 4).

Frames follow REP 103 (x forward, y left, z up); headings are counter-clockwise positive and
wrapped to (-pi, pi]. `T_a_b` maps coordinates in b to a, and so do poses: `pose_a_c =
compose(pose_a_b, pose_b_c)`. Every function is vectorised over leading axes.
"""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]

# Below this angle the closed forms of sin(x)/x and its kin lose digits; the series is exact there.
_SMALL = 1e-4


def wrap(angle: ArrayLike) -> Array:
    """Angle [rad] of any shape, wrapped to (-pi, pi]."""
    angle = np.asarray(angle, dtype=np.float64)
    in_range = abs(float(angle)) < np.pi if angle.ndim == 0 else (np.abs(angle) < np.pi).all()
    if in_range:  # most are, and the rest of this costs ten times as much
        return angle.copy()
    wrapped = np.pi - np.mod(np.pi - angle, 2 * np.pi)
    # A remainder just short of a full turn rounds up to it; an angle in range keeps its bits.
    wrapped = np.where(wrapped <= -np.pi, np.pi, wrapped)
    return np.where(np.abs(angle) < np.pi, angle, wrapped)


def _sinc(x: Array) -> Array:
    """sin(x) / x."""
    return np.sinc(x / np.pi)


def _cosc(x: Array) -> Array:
    """(1 - cos(x)) / x."""
    safe = np.where(np.abs(x) < _SMALL, 1.0, x)
    return np.where(np.abs(x) < _SMALL, x / 2 - x**3 / 24, 2 * np.sin(safe / 2) ** 2 / safe)


def rotate(heading: ArrayLike, vector: ArrayLike) -> Array:
    """Planar vectors (..., 2), turned by heading (...) [rad]."""
    return _joined(*_turned(heading, *_parts(vector)))


def compose(a: ArrayLike, b: ArrayLike) -> Array:
    """Pose b (..., 3), given in the frame of pose a, expressed in a's parent: a (+) b."""
    (x, y, heading), (ahead, aside, turn) = _parts(a), _parts(b)
    dx, dy = _turned(heading, ahead, aside)
    return _joined(x + dx, y + dy, wrap(heading + turn))


def inverse(a: ArrayLike) -> Array:
    """The pose that undoes a: compose(a, inverse(a)) is zero."""
    x, y, heading = _parts(a)
    ahead, aside = _turned(-heading, x, y)
    return _joined(-ahead, -aside, wrap(-heading))


def between(a: ArrayLike, b: ArrayLike) -> Array:
    """Pose b (..., 3) seen from pose a: compose(a, between(a, b)) is b."""
    (x, y, heading), (to_x, to_y, to_heading) = _parts(a), _parts(b)
    ahead, aside = _turned(-heading, to_x - x, to_y - y)
    return _joined(ahead, aside, wrap(to_heading - heading))


def compose_jacobians(a: ArrayLike, b: ArrayLike) -> tuple[Array, Array]:
    """Derivatives (..., 3, 3) of compose(a, b) with respect to a and to b."""
    (_, _, heading), (ahead, aside, _) = _parts(a), _parts(b)
    dx, dy = _turned(heading + np.pi / 2, ahead, aside)
    wrt_a, wrt_b = _identities(np.shape(dx)), _identities(np.shape(dx))
    wrt_a[..., 0, 2], wrt_a[..., 1, 2] = dx, dy
    c, s = np.cos(heading), np.sin(heading)
    wrt_b[..., 0, 0], wrt_b[..., 0, 1] = c, -s
    wrt_b[..., 1, 0], wrt_b[..., 1, 1] = s, c
    return wrt_a, wrt_b


def between_jacobians(a: ArrayLike, b: ArrayLike) -> tuple[Array, Array]:
    """Derivatives (..., 3, 3) of between(a, b) with respect to a and to b."""
    (x, y, heading), (to_x, to_y, _) = _parts(a), _parts(b)
    ahead, aside = _turned(-heading, to_x - x, to_y - y)
    c, s = np.cos(heading), np.sin(heading)
    wrt_b = _identities(np.shape(ahead))
    wrt_b[..., 0, 0], wrt_b[..., 0, 1] = c, s
    wrt_b[..., 1, 0], wrt_b[..., 1, 1] = -s, c
    wrt_a = -wrt_b
    wrt_a[..., 0, 2], wrt_a[..., 1, 2] = aside, -ahead
    return wrt_a, wrt_b


def _parts(vectors: ArrayLike) -> Any:
    """Of vectors (..., n) their n coordinates (...): of a single one plain numbers, with which
    NumPy computes the same several times as fast."""
    vectors = np.asarray(vectors, dtype=np.float64)
    if vectors.ndim == 1:
        return vectors.tolist()
    return [vectors[..., k] for k in range(vectors.shape[-1])]


def _joined(*parts: Any) -> Array:
    """(..., n) of n coordinates (...), all of one shape."""
    if np.ndim(parts[0]) == 0:
        return np.array(parts)
    joined = np.empty((*np.shape(parts[0]), len(parts)))
    for k, part in enumerate(parts):
        joined[..., k] = part
    return joined


def _turned(heading: ArrayLike, x: Any, y: Any) -> tuple[Any, Any]:
    c, s = np.cos(heading), np.sin(heading)
    return c * x - s * y, s * x + c * y


def _identities(shape: tuple[int, ...]) -> Array:
    """(..., 3, 3)"""
    return np.zeros((*shape, 3, 3)) + np.eye(3)


def exp(twist: ArrayLike) -> Array:
    """Pose reached by holding the body twist (..., 3) (forward [m], left [m], turn [rad]) for 1."""
    twist = np.asarray(twist, dtype=np.float64)
    turn = twist[..., 2]
    along, across = _sinc(turn), _cosc(turn)
    x = along * twist[..., 0] - across * twist[..., 1]
    y = across * twist[..., 0] + along * twist[..., 1]
    return np.stack([x, y, wrap(turn)], axis=-1)


def log(pose: ArrayLike) -> Array:
    """The body twist (..., 3) that reaches pose within half a turn: exp(log(pose)) is pose."""
    pose = np.asarray(pose, dtype=np.float64)
    turn = wrap(pose[..., 2])
    half = turn / 2
    # (t/2) cot(t/2), finite on (-pi, pi] and 1 at zero.
    k = np.cos(half) / _sinc(half)
    x = k * pose[..., 0] + half * pose[..., 1]
    y = -half * pose[..., 0] + k * pose[..., 1]
    return np.stack([x, y, turn], axis=-1)


# --- SE(3), where a mount or an uneven ground needs it -------------------------------------------


def transform(rotation: ArrayLike, translation: ArrayLike) -> Array:
    """T (..., 4, 4) from rotation (..., 3, 3) and translation (..., 3) [m]."""
    rotation = np.asarray(rotation, dtype=np.float64)
    translation = np.asarray(translation, dtype=np.float64)
    leading = np.broadcast_shapes(rotation.shape[:-2], translation.shape[:-1])
    T = np.zeros((*leading, 4, 4))
    T[..., :3, :3], T[..., :3, 3], T[..., 3, 3] = rotation, translation, 1.0
    return T


def inverse_transform(T: ArrayLike) -> Array:
    """T_b_a (..., 4, 4) from T_a_b."""
    T = np.asarray(T, dtype=np.float64)
    R_transposed = np.swapaxes(T[..., :3, :3], -1, -2)
    return transform(R_transposed, -(R_transposed @ T[..., :3, 3:])[..., 0])


def rotation_from_rpy(roll: float, pitch: float, yaw: float) -> Array:
    """Rotation (3, 3) = Rz(yaw) Ry(pitch) Rx(roll); a positive pitch lowers the nose (x)."""
    cr, sr, cp, sp = np.cos(roll), np.sin(roll), np.cos(pitch), np.sin(pitch)
    cy, sy = np.cos(yaw), np.sin(yaw)
    return np.array(
        [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
    )


def skew(v: ArrayLike) -> Array:
    """Matrices (..., 3, 3) with skew(v) @ w = cross(v, w)."""
    v = np.asarray(v, dtype=np.float64)
    S = np.zeros((*v.shape, 3))
    S[..., 2, 1], S[..., 0, 2], S[..., 1, 0] = v[..., 0], v[..., 1], v[..., 2]
    return S - np.swapaxes(S, -1, -2)


def so3_exp(rotation_vector: ArrayLike) -> Array:
    """Rotation (..., 3, 3) about rotation_vector (..., 3) by its length [rad] (Rodrigues)."""
    v = np.asarray(rotation_vector, dtype=np.float64)
    angle = np.linalg.norm(v, axis=-1)[..., None, None]
    S = skew(v)
    half_sinc = _sinc(angle / 2)
    return np.eye(3) + _sinc(angle) * S + 0.5 * half_sinc**2 * (S @ S)


def lift(pose: ArrayLike) -> Array:
    """T (..., 4, 4) of a planar pose (..., 3), at height zero and level."""
    pose = np.asarray(pose, dtype=np.float64)
    T = np.zeros((*pose.shape[:-1], 4, 4)) + np.eye(4)
    c, s = np.cos(pose[..., 2]), np.sin(pose[..., 2])
    T[..., 0, 0], T[..., 0, 1], T[..., 1, 0], T[..., 1, 1] = c, -s, s, c
    T[..., :2, 3] = pose[..., :2]
    return T


def project(T: ArrayLike) -> Array:
    """Planar pose (..., 3) of T (..., 4, 4): position without height, heading of the x axis."""
    T = np.asarray(T, dtype=np.float64)
    heading = np.arctan2(T[..., 1, 0], T[..., 0, 0])
    if T.ndim == 2:  # the same for one, a few times faster
        return np.array([T[0, 3], T[1, 3], heading if heading > -np.pi else np.pi])
    pose = np.empty((*T.shape[:-2], 3))
    pose[..., :2] = T[..., :2, 3]
    pose[..., 2] = np.where(heading > -np.pi, heading, np.pi)  # of the two, pi is in range
    return pose
