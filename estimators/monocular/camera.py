"""The measurement model: where the filter's points appear after the motion, with derivatives.

A point (u, v, inverse depth) moves as a point of disparity space does: with a baseline of 1 / f a
disparity in px is an inverse depth in 1/m, so that the kernels of `visual.motion` serve here too.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from grouser.estimators.monocular.state import HEAD, MOTION, SlamState
from grouser.estimators.visual.motion import camera_motion, measure
from grouser.geometry import Array
from grouser.kernels import kernel, kernel_using
from grouser.rig import StereoCamera

_MOTION, _HEAD = MOTION.start, HEAD  # numba takes whole numbers for constants, but no slices


def inverse_depth_intrinsics(camera: StereoCamera) -> Array:
    """(5,) fx, fy, cx, cy [px] and the baseline [m] that makes a disparity an inverse depth."""
    return np.array([camera.fx, camera.fy, camera.cx, camera.cy, 1 / camera.fx])


@dataclass(frozen=True, slots=True)
class Projection:
    """The filter's points as seen after its motion; NaN behind the camera."""

    points: Array
    """(n, 3) u, v [px], inverse depth [1/m] in the current camera"""
    by_point: Array
    """(n, 3, 3) derivative by the point in the previous camera"""
    by_motion: Array
    """(n, 3, 6) derivative by the motion"""

    def keeping(self, kept: NDArray[np.bool_]) -> "Projection":
        """Without the points (n,) that are not kept."""
        return Projection(self.points[kept], self.by_point[kept], self.by_motion[kept])


@dataclass(frozen=True, slots=True)
class Matches:
    """What was measured in one image."""

    seen: NDArray[np.int64]
    """(m,) indices of the state's points"""
    places: Array
    """(m, 2) px"""
    noise: Array
    """(m,) variance of either coordinate, px^2"""

    def of(self, chosen: NDArray[np.bool_]) -> "Matches":
        """The chosen (m,) of them."""
        return Matches(self.seen[chosen], self.places[chosen], self.noise[chosen])


@dataclass(frozen=True, slots=True)
class Innovation:
    """Measured minus predicted places of m points, and what goes with them in the update."""

    residual: Array
    """(2 m,) px"""
    covariance: Array
    """(2 m, 2 m) S = H P H^T + R"""
    cross: Array
    """(2 m, state) H P"""

    def of(self, chosen: NDArray[np.bool_]) -> "Innovation":
        """The part of the chosen points (m,)."""
        rows = np.repeat(chosen, 2)
        S = np.ascontiguousarray(self.covariance[rows][:, rows])
        return Innovation(self.residual[rows], S, self.cross[rows])

    def squared(self) -> Array:
        """(m,) squared Mahalanobis length of each point's residual: chi-square of 2."""
        r = self.residual.reshape(-1, 2)
        own = np.arange(0, len(self.residual), 2)
        a, b = self.covariance[own, own], self.covariance[own, own + 1]
        c = self.covariance[own + 1, own + 1]
        top = c * r[:, 0] ** 2 - 2 * b * r[:, 0] * r[:, 1] + a * r[:, 1] ** 2
        return np.asarray(top / (a * c - b * b))


def project(state: SlamState, T_base_camera: Array, intrinsics: Array) -> Projection:
    """Where the state's points are seen after its motion."""
    return Projection(*_project(state.points, state.motion, T_base_camera, intrinsics))


def innovation(
    prior: SlamState, matches: Matches, at: SlamState, projection: Projection
) -> Innovation:
    """Of what was measured against the prior, linearised at a state that has the same points.

    z - h(at) - H (prior - at): where `at` is the prior itself, plainly measured minus predicted;
    elsewhere a step of the iterated filter.

    Args:
        projection: of the state `at`.
    """
    seen = matches.seen
    cross, covariance = _spread(
        prior.covariance, projection.by_point, projection.by_motion, seen, matches.noise
    )
    moved = at.motion - prior.motion
    shifted = at.points[seen] - prior.points[seen]
    residual = matches.places - projection.points[seen, :2]
    residual += projection.by_motion[seen, :2] @ moved
    residual += np.einsum("nij,nj->ni", projection.by_point[seen, :2], shifted)
    return Innovation(residual.ravel(), covariance, cross)


def place_covariances(state: SlamState, projection: Projection) -> Array:
    """(n, 2, 2) of where the points are predicted [px^2]: H P H^T; NaN behind the camera."""
    return np.asarray(_own_spread(state.covariance, projection.by_point, projection.by_motion))


@kernel
def _own_spread(P: Array, by_point: Array, by_motion: Array) -> Array:
    n = by_point.shape[0]
    out = np.empty((n, 2, 2))
    J, JP, where = np.empty((2, 9)), np.empty((2, 9)), np.empty(9, np.int64)
    for i in range(n):
        for c in range(6):
            where[c] = _MOTION + c
        for c in range(3):
            where[6 + c] = _HEAD + 3 * i + c
        J[:, :6], J[:, 6:] = by_motion[i, :2], by_point[i, :2]
        for r in range(2):
            for c in range(9):
                JP[r, c] = 0.0
                for k in range(9):
                    JP[r, c] += J[r, k] * P[where[k], where[c]]
        for r in range(2):
            for c in range(2):
                out[i, r, c] = 0.0
                for k in range(9):
                    out[i, r, c] += JP[r, k] * J[c, k]
    return out


@kernel_using(measure, camera_motion)
def _project(
    points: Array, motion: Array, T_base_camera: Array, camera: Array
) -> tuple[Array, Array, Array]:
    A, b, dA, db = camera_motion(motion, T_base_camera)
    n = points.shape[0]
    seen, by_point, by_motion = np.empty((n, 3)), np.empty((n, 3, 3)), np.empty((n, 3, 6))
    for i in range(n):
        if not measure(points[i], A, b, dA, db, camera, seen[i], by_point[i], by_motion[i]):
            seen[i] = np.nan
            by_point[i] = np.nan
            by_motion[i] = np.nan
    return seen, by_point, by_motion


@kernel
def _spread(
    P: Array, by_point: Array, by_motion: Array, seen: NDArray[np.int64], noise: Array
) -> tuple[Array, Array]:
    """H P (2 m, state) and H P H^T + R (2 m, 2 m); H has nine numbers a row that are not zero."""
    m, size = seen.shape[0], P.shape[0]
    cross, S = np.empty((2 * m, size)), np.empty((2 * m, 2 * m))
    for k in range(m):
        i = seen[k]
        for r in range(2):
            row = cross[2 * k + r]
            row[:] = 0.0
            for c in range(6):
                row += by_motion[i, r, c] * P[_MOTION + c]
            for c in range(3):
                row += by_point[i, r, c] * P[_HEAD + 3 * i + c]
    for k in range(m):
        i = seen[k]
        for r in range(2):
            for other in range(2 * k + r + 1):
                total = 0.0
                for c in range(6):
                    total += by_motion[i, r, c] * cross[other, _MOTION + c]
                for c in range(3):
                    total += by_point[i, r, c] * cross[other, _HEAD + 3 * i + c]
                S[2 * k + r, other] = S[other, 2 * k + r] = total
            S[2 * k + r, 2 * k + r] += noise[k]
    return cross, S
