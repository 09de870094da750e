"""What the filter estimates: pose, constant errors, the last motion and the points in view."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from grouser.geometry import Array, so3_exp, transform

POSITION, ROTATION = slice(0, 3), slice(3, 6)
POSE = slice(0, 6)
CONSTANTS = slice(6, 11)
"""The tracks' constant errors (see `motion_model`)."""
MOTION = slice(11, 17)
HEAD = 17
"""Numbers before the points', of which each has three."""


@dataclass(frozen=True, slots=True)
class SlamState:
    """The estimate and the covariance of its errors, in the order above.

    While an image is compared, `motion` leads from the previous camera, in whose frame the points
    are, to the current one. Between images it is zero and known.
    """

    T_start_base: Array
    """(4, 4) the robot before the motion. Its errors are additive in position [m] and, turned from
    the left, exp(error) @ R, in rotation [rad]: both along the axes of the start."""
    constants: Array
    """(5,)"""
    motion: Array
    """(6,) turn, chord, side, height, roll, pitch as in `visual.motion`"""
    points: Array
    """(n, 3) u, v [px], inverse depth [1/m] along the optical axis"""
    covariance: Array
    """(17 + 3 n, 17 + 3 n)"""

    def corrected(self, change: Array, covariance: Array) -> "SlamState":
        """After an update that adds `change` (17 + 3 n,) to the estimate."""
        T = self.T_start_base
        rotation = so3_exp(change[ROTATION]) @ T[:3, :3]
        return SlamState(
            transform(rotation, T[:3, 3] + change[POSITION]),
            self.constants + change[CONSTANTS],
            self.motion + change[MOTION],
            self.points + change[HEAD:].reshape(-1, 3),
            covariance,
        )

    def keeping(self, kept: NDArray[np.bool_]) -> "SlamState":
        """Without the points (n,) that are not kept: a marginal of a normal density."""
        rows = np.concatenate([np.ones(HEAD, dtype=bool), np.repeat(kept, 3)])
        return replace(
            self,
            points=self.points[kept],
            covariance=np.ascontiguousarray(self.covariance[rows][:, rows]),
        )

    def with_points(self, points: Array, sigma: Array) -> "SlamState":
        """With new points (k, 3), whose errors (3,) have nothing to do with any other's.

        In the camera's own frame this is exact: a new point is where the camera sees it, wherever
        the robot is.
        """
        n, k = len(self.covariance), len(points)
        covariance = np.zeros((n + 3 * k, n + 3 * k))
        covariance[:n, :n] = self.covariance
        covariance[n:, n:] = np.diag(np.tile(sigma**2, k))
        return replace(self, points=np.concatenate([self.points, points]), covariance=covariance)


def initial_state(constant_sigmas: Array) -> SlamState:
    """At the start, which is known; the constant errors (5,) are as large as their sigmas say."""
    covariance = np.zeros((HEAD, HEAD))
    covariance[CONSTANTS, CONSTANTS] = np.diag(constant_sigmas**2)
    return SlamState(np.eye(4), np.zeros(5), np.zeros(6), np.zeros((0, 3)), covariance)


def planar_covariance(state: SlamState) -> Array:
    """(3, 3) of x, y and the heading of the robot's x axis."""
    forward = state.T_start_base[:3, 0]
    J = np.zeros((3, 6))
    J[0, 0] = J[1, 1] = 1.0
    # heading = atan2(forward_y, forward_x), and an error e of the rotation moves forward by e x it
    level = forward[0] ** 2 + forward[1] ** 2
    J[2, 3:] = [-forward[2] * forward[0] / level, -forward[2] * forward[1] / level, 1.0]
    covariance = J @ state.covariance[POSE, POSE] @ J.T
    return np.asarray((covariance + covariance.T) / 2)
