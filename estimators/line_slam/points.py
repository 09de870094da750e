"""Landmarks that are points, seen by range and bearing: paper 2, eqs. (10) to (12)."""

from dataclasses import dataclass

import numpy as np

from grouser.frozen import freeze, rebuilt
from grouser.geometry import Array, wrap


@dataclass(frozen=True, slots=True, eq=False)
class PointMap:
    """n points in the frame of the start, with how well they are known."""

    points: Array
    """(n, 2) x and y, m."""
    covariance: Array
    """(2n, 2n) of x_1, y_1, x_2, y_2, ..."""

    def __post_init__(self) -> None:
        freeze(self)

    def __len__(self) -> int:
        """How many points."""
        return len(self.points)

    def __reduce__(self) -> tuple[object, ...]:
        return rebuilt(self)


def polar(points: Array, pose: Array) -> Array:
    """(n, 2) range [m] and bearing [rad] of points (n, 2) as seen from a pose (3,): eq. (10), with
    atan2, and wrapped."""
    away = points - pose[:2]
    bearings = wrap(np.arctan2(away[:, 1], away[:, 0]) - pose[2])
    return np.column_stack([np.hypot(away[:, 0], away[:, 1]), bearings])


def polar_jacobians(points: Array, pose: Array, *, printed: bool = False) -> Array:
    """(n, 2, 5) derivative of `polar` by x, y, heading of the pose, and the point's x, y: eq. (11).

    The paper prints the bearing's derivative by the point as (-dx, -dy) / d^2, which is
    (dy, -dx) / d^2 (SPEC 2.1); `printed` takes it as printed.
    """
    dx, dy = (pose[:2] - points).T  # eq. (12): from the point to the robot
    d = np.maximum(np.hypot(dx, dy), _NEAREST)
    H = np.zeros((len(points), 2, 5))
    H[:, 0, 0], H[:, 0, 1] = dx / d, dy / d
    H[:, 1, 0], H[:, 1, 1], H[:, 1, 2] = -dy / d**2, dx / d**2, -1.0
    H[:, :, 3:] = -H[:, :, :2]
    if printed:
        H[:, 1, 3], H[:, 1, 4] = -dx / d**2, -dy / d**2
    return H


def seen_at(measured: Array, pose: Array) -> tuple[Array, Array, Array]:
    """Where a point seen at a range and bearing (2,) from a pose (3,) is: (2,), and its derivatives
    by the pose (2, 3) and by what was measured (2, 2)."""
    d, angle = measured[0], measured[1] + pose[2]
    c, s = np.cos(angle), np.sin(angle)
    point = pose[:2] + d * np.array([c, s])
    return (
        point,
        np.array([[1.0, 0.0, -d * s], [0.0, 1.0, d * c]]),
        np.array([[c, -d * s], [s, d * c]]),
    )


_NEAREST = 1e-3  # m: at the robot's origin, a bearing has no derivative
