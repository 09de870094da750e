"""The filter's points as landmarks in the frame of the start."""

from dataclasses import dataclass

import numpy as np

from grouser.estimators.monocular.state import HEAD, POSE, SlamState
from grouser.geometry import Array, skew
from grouser.rig import StereoCamera

_CERTAIN = 3.0  # sigmas that an inverse depth is above zero: nearer ones may be at infinity


@dataclass(frozen=True, slots=True)
class LandmarkMap:
    """Points in the frame of the start."""

    positions: Array
    """(n, 3) m"""
    covariances: Array
    """(n, 3, 3) m^2, the pose's uncertainty included"""


def landmarks(state: SlamState, camera: StereoCamera) -> LandmarkMap:
    """Of the points in view, those whose distance is known well enough to be a place."""
    depth_sigma = np.sqrt(np.diag(state.covariance)[HEAD + 2 :: 3])
    certain = np.flatnonzero(state.points[:, 2] > _CERTAIN * depth_sigma)
    positions = np.empty((len(certain), 3))
    covariances = np.empty((len(certain), 3, 3))
    for k, i in enumerate(certain):
        positions[k], J = _place(state, camera, state.points[i])
        own = slice(HEAD + 3 * i, HEAD + 3 * i + 3)
        rows = np.r_[POSE, own]
        covariances[k] = J @ state.covariance[np.ix_(rows, rows)] @ J.T
    return LandmarkMap(positions, covariances)


def _place(state: SlamState, camera: StereoCamera, point: Array) -> tuple[Array, Array]:
    """A point (u, v, inverse depth) in the frame of the start [m]; its derivative (3, 9) by the
    pose's errors and by the point."""
    u, v, inverse_depth = point
    p_camera = np.array([(u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy, 1.0])
    p_camera /= inverse_depth
    T = state.T_start_base
    R = T[:3, :3] @ camera.T_base_camera[:3, :3]
    lever = R @ p_camera + T[:3, :3] @ camera.T_base_camera[:3, 3]
    by_point = np.column_stack(
        [
            R[:, 0] / (camera.fx * inverse_depth),
            R[:, 1] / (camera.fy * inverse_depth),
            -R @ p_camera / inverse_depth,
        ]
    )
    return T[:3, 3] + lever, np.column_stack([np.eye(3), -skew(lever), by_point])
