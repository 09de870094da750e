"""How far an estimated trajectory is from the true one; frame k of one is frame k of the other.

Trajectories are transforms (N, 4, 4); a planar one is lifted to them first, and its figures are
then those of the plane. Nothing is ever aligned in scale: stereo knows it.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from grouser.geometry import Array, inverse_transform

Frames = NDArray[np.signedinteger[Any]]

SEGMENT_LENGTHS = (5.0, 10.0, 20.0, 40.0)
"""m. KITTI's own, 100 to 800 m, are for cars."""


@dataclass(frozen=True, slots=True)
class Drift:
    """Errors of segments relative to their length, averaged over all segments."""

    translation_percent: float
    rotation_deg_per_m: float


def distances(poses: Array) -> Array:
    """Length (N,) of the path (N, 4, 4) up to each frame, m."""
    steps = np.linalg.norm(np.diff(poses[:, :3, 3], axis=0), axis=1)
    return np.concatenate([[0.0], np.cumsum(steps)])


def ate_se2(truth: Array, estimate: Array) -> float:
    """Absolute trajectory error, m: RMSE of positions on the plane after SE(2) alignment.

    Both are positions (N, 2 or more) of which x and y count. The rotation that minimises the
    squared distances has a closed form on the plane, defined for straight paths too.
    """
    p, q = truth[:, :2], estimate[:, :2]
    p, q = p - p.mean(axis=0), q - q.mean(axis=0)
    angle = np.arctan2(np.sum(q[:, 0] * p[:, 1] - q[:, 1] * p[:, 0]), np.sum(p * q))
    c, s = np.cos(angle), np.sin(angle)
    return _rmse(np.linalg.norm(p - q @ np.array([[c, s], [-s, c]]), axis=1))


def ate_se3(truth: Array, estimate: Array) -> float:
    """Absolute trajectory error, m: RMSE of positions (N, 3) after SE(3) alignment.

    Umeyama, "Least-squares estimation of transformation parameters between two point patterns",
    PAMI 1991, eqs. (40) and (41) with the scale held at one.
    """
    p, q = truth - truth.mean(axis=0), estimate - estimate.mean(axis=0)
    U, _, Vt = np.linalg.svd(p.T @ q)
    # A mirror image may fit better than any rotation; it is not a motion.
    sign = np.diag([1.0, 1.0, np.sign(np.linalg.det(U) * np.linalg.det(Vt))])
    return _rmse(np.linalg.norm(p - q @ (U @ sign @ Vt).T, axis=1))


def rpe(truth: Array, estimate: Array) -> tuple[float, float]:
    """Relative pose error from each frame to the next: RMSE of translation [m] and angle [rad]."""
    first = np.arange(len(truth) - 1)
    translation, angle = relative_errors(truth, estimate, first, first + 1)
    return _rmse(translation), _rmse(angle)


def drift(
    truth: Array, estimate: Array, lengths: tuple[float, ...] = SEGMENT_LENGTHS
) -> Drift | None:
    """KITTI's error of segments: end pose against the true one, over the segment's length.

    As in KITTI's development kit (Geiger et al., "Are we ready for autonomous driving?", CVPR
    2012), except that a segment starts at every frame, not at every tenth, for short recordings.
    None where no segment fits into the path.
    """
    along = distances(truth)
    first, last, length = _segments(along, lengths)
    if len(first) == 0:
        return None
    translation, angle = relative_errors(truth, estimate, first, last)
    return Drift(
        translation_percent=float(np.mean(100 * translation / length)),
        rotation_deg_per_m=float(np.mean(np.degrees(angle) / length)),
    )


def relative_errors(
    truth: Array, estimate: Array, first: Frames, last: Frames
) -> tuple[Array, Array]:
    """Translation [m] and angle [rad] by which the motion from `first` to `last` is wrong."""
    true_motion = inverse_transform(truth[first]) @ truth[last]
    motion = inverse_transform(estimate[first]) @ estimate[last]
    error = inverse_transform(true_motion) @ motion
    return np.linalg.norm(error[:, :3, 3], axis=1), _angles(error[:, :3, :3])


def _segments(along: Array, lengths: tuple[float, ...]) -> tuple[Frames, Frames, Array]:
    """First frame, last frame and nominal length of each segment that ends within the path."""
    firsts, lasts, nominal = [], [], []
    for length in lengths:
        last = np.searchsorted(along, along + length, side="right")
        first = np.flatnonzero(last < len(along))
        firsts.append(first)
        lasts.append(last[first])
        nominal.append(np.full(len(first), length))
    return np.concatenate(firsts), np.concatenate(lasts), np.concatenate(nominal)


def _angles(rotations: Array) -> Array:
    """(N,) rad, exact near zero, where the arc cosine of the trace loses half of the digits."""
    chord = np.linalg.norm(rotations - np.eye(3), axis=(1, 2)) / np.sqrt(8.0)
    angles: Array = 2 * np.arcsin(np.minimum(chord, 1.0))
    return angles


def _rmse(errors: Array) -> float:
    return float(np.sqrt(np.mean(np.square(errors))))
