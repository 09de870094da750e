"""Scans that another one is laid over."""

from collections.abc import Sequence
from statistics import median
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from grouser.estimators.scan_matching.nearest_field import NearestField, nearest_field
from grouser.estimators.scan_matching.shared_lines import SharedLines, shared_lines
from grouser.estimators.scan_matching.surface import Surface
from grouser.geometry import Array
from grouser.kernels import kernel


class Reference(NamedTuple):
    """k scans at fixed poses, as one surface."""

    surface: Surface
    """Their n points, in the frame of the poses."""
    scans: NDArray[np.int32]
    """(n,) which scan each point is of"""
    poses: Array
    """(k, 3)"""
    field: NearestField
    shared: SharedLines
    """What the scans tell together."""


def make_reference(surfaces: Sequence[Surface], poses: Array) -> Reference:
    """The reference that k surfaces, each in the frame of its scan, make at the poses (k, 3).

    Raises:
        ValueError: there is not one pose for each surface, or no surface.
    """
    poses = np.array(poses, dtype=np.float64).reshape(-1, 3)
    if len(surfaces) != len(poses) or not len(poses):
        raise ValueError(
            f"a reference needs scans, each with a pose, got {len(surfaces)} scans and "
            f"{len(poses)} poses"
        )
    counts = [len(one.points) for one in surfaces]
    first = np.cumsum([0, *counts])
    n = int(first[-1])
    points, feet, normals = np.empty((n, 2)), np.empty((n, 2)), np.empty((n, 2))
    for at, one, pose in zip(first.tolist(), surfaces, poses, strict=False):
        _lay(one.points, one.feet, one.normals, pose, at, points, feet, normals)
    surface = Surface(
        points,
        feet,
        normals,
        np.concatenate([one.normal_sigmas for one in surfaces]),
        median(one.sigma for one in surfaces),
    )
    scans = np.repeat(np.arange(len(surfaces), dtype=np.int32), counts)
    return Reference(
        surface,
        scans,
        poses,
        nearest_field(points, REACH, _CELL),
        shared_lines(surface, scans, len(surfaces)),
    )


@kernel
def _lay(
    points: Array,
    feet: Array,
    normals: Array,
    pose: Array,
    at: int,
    laid_points: Array,
    laid_feet: Array,
    laid_normals: Array,
) -> None:
    """Write a surface, moved by the pose (3,), from row `at` on."""
    c, s = np.cos(pose[2]), np.sin(pose[2])
    for k in range(len(points)):
        i, x, y = at + k, points[k, 0], points[k, 1]
        laid_points[i, 0], laid_points[i, 1] = pose[0] + (c * x - s * y), pose[1] + (s * x + c * y)
        x, y = feet[k, 0], feet[k, 1]
        laid_feet[i, 0], laid_feet[i, 1] = pose[0] + (c * x - s * y), pose[1] + (s * x + c * y)
        x, y = normals[k, 0], normals[k, 1]
        laid_normals[i, 0], laid_normals[i, 1] = c * x - s * y, s * x + c * y


REACH = 0.3
"""m from a point of the scan to what it is taken for, at most."""
_CELL = 0.05
"""m"""
