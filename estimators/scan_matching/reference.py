"""Scans that another one is laid over."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from grouser.estimators.scan_matching.nearest_field import NearestField, nearest_field
from grouser.estimators.scan_matching.surface import Surface, moved
from grouser.geometry import Array


class Reference(NamedTuple):
    """k scans at fixed poses, as one surface."""

    surface: Surface
    """Their n points, in the frame of the poses."""
    scans: NDArray[np.int32]
    """(n,) which scan each point is of"""
    poses: Array
    """(k, 3)"""
    field: NearestField


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
    laid = [moved(surface, pose) for surface, pose in zip(surfaces, poses, strict=True)]
    surface = Surface(
        np.concatenate([one.points for one in laid]),
        np.concatenate([one.feet for one in laid]),
        np.concatenate([one.normals for one in laid]),
        np.concatenate([one.normal_sigmas for one in laid]),
        float(np.median([one.sigma for one in laid])),
    )
    counts = [len(one.points) for one in laid]
    scans = np.repeat(np.arange(len(laid), dtype=np.int32), counts)
    return Reference(surface, scans, poses, nearest_field(surface.points, REACH, _CELL))


REACH = 0.3
"""m from a point of the scan to what it is taken for, at most."""
_CELL = 0.05
"""m"""
