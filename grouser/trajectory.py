"""Trajectories on disk: TUM (stamp x y z qx qy qz qw) and KITTI (3 x 4 pose, 12 numbers a line).

Both are readable by evo. With covariance, a TUM line goes on with the upper triangle of the planar
covariance (xx xy xh yy yh hh; h is the heading), which evo does not read.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from grouser.geometry import Array, transform
from grouser.text_table import read_rows

_UPPER = np.triu_indices(3)
# Printed poses are rounded; what is farther from a rotation than this is something else.
_ROTATION_TOLERANCE = 1e-2


@dataclass(frozen=True, slots=True)
class Trajectory:
    """Poses over time."""

    stamps: Array
    """(N,) s"""
    poses: Array
    """(N, 4, 4) T_world_body."""
    covariances: Array | None = None
    """(N, 3, 3) of x, y, heading, where they are known."""


def write_tum(path: str | Path, trajectory: Trajectory) -> None:
    """Write a trajectory as TUM, with the covariance in six further columns where it is known."""
    quaternions = Rotation.from_matrix(trajectory.poses[:, :3, :3]).as_quat()
    columns = [trajectory.stamps[:, None], trajectory.poses[:, :3, 3], quaternions]
    header = "stamp x y z qx qy qz qw"
    if trajectory.covariances is not None:
        columns.append(trajectory.covariances[:, _UPPER[0], _UPPER[1]])
        header += " c_xx c_xy c_xh c_yy c_yh c_hh"
    rows = np.concatenate(columns, axis=1)
    # Nanoseconds of a clock that counts from 1970 need their places after the point.
    formats = ["%.9f", *["%.12g"] * (rows.shape[1] - 1)]
    np.savetxt(path, rows, fmt=formats, header=header)


def read_tum(path: str | Path) -> Trajectory:
    """Read a TUM trajectory of 8 columns, or of 14 with covariance.

    Raises:
        FileNotFoundError: there is no such file.
        ValueError: a malformed row, named by file and line.
    """
    rows, lines = read_rows(path, 8, 14)
    lengths = np.linalg.norm(rows[:, 4:8], axis=1)
    for length, line in zip(lengths, lines, strict=True):
        if abs(length - 1) > _ROTATION_TOLERANCE:
            raise ValueError(
                f"{path}:{line}: the quaternion (columns 5 to 8) has length {length:.4g}, not 1"
            )
    poses = transform(Rotation.from_quat(rows[:, 4:8]).as_matrix(), rows[:, 1:4])
    return Trajectory(rows[:, 0], poses, _covariances(rows[:, 8:]))


def _covariances(columns: Array) -> Array | None:
    if columns.shape[1] == 0:
        return None
    covariances = np.empty((len(columns), 3, 3))
    covariances[:, _UPPER[0], _UPPER[1]] = columns
    covariances[:, _UPPER[1], _UPPER[0]] = columns
    return covariances


def write_kitti(path: str | Path, poses: Array) -> None:
    """Write poses (N, 4, 4) as KITTI."""
    np.savetxt(path, poses[:, :3].reshape(len(poses), 12), fmt="%.12e")


def read_kitti(path: str | Path) -> Array:
    """Poses (N, 4, 4) of a KITTI file; its rounded rotations are made exact ones.

    Raises:
        FileNotFoundError: there is no such file.
        ValueError: a malformed row, or one that is no rigid motion, named by file and line.
    """
    rows, lines = read_rows(path, 12)
    parts = rows.reshape(-1, 3, 4)
    for part, line in zip(parts, lines, strict=True):
        rotation = part[:, :3]
        skewed = np.abs(rotation @ rotation.T - np.eye(3)).max() > _ROTATION_TOLERANCE
        if skewed or np.linalg.det(rotation) < 0:
            raise ValueError(f"{path}:{line}: the first three columns of the pose are no rotation")
    return transform(Rotation.from_matrix(parts[:, :, :3]).as_matrix(), parts[:, :, 3])
