"""What the filter's points look like: the patch at first sight, the descriptor at the last."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from grouser.estimators.visual.descriptor import PATCH_RADIUS, Descriptors, Image
from grouser.geometry import Array, inverse_transform
from grouser.rig import StereoCamera

SIZE = 2 * PATCH_RADIUS + 1
"""Side of a stored patch, px: what fits around a corner that can be described."""


@dataclass(frozen=True, slots=True)
class Appearance:
    """How n points are recognised, and how well that went.

    A patch stays the one of the first sight, so that its place does not creep from frame to frame;
    a descriptor, which need not be exact, is renewed at every sight and follows the view.
    """

    patches: NDArray[np.uint8]
    """(n, SIZE, SIZE) of the smoothed image, the point in the middle"""
    T_start_camera: Array
    """(n, 4, 4) the camera at first sight, as far as it was known then"""
    descriptors: Descriptors
    """(n, 4)"""
    sought: NDArray[np.int64]
    """(n,) frames in which the point should have been seen"""
    found: NDArray[np.int64]
    """(n,) frames in which it was"""
    missed: NDArray[np.int64]
    """(n,) frames since"""

    def keeping(self, kept: NDArray[np.bool_]) -> "Appearance":
        """Without the points (n,) that are not kept."""
        return Appearance(
            self.patches[kept],
            self.T_start_camera[kept],
            self.descriptors[kept],
            self.sought[kept],
            self.found[kept],
            self.missed[kept],
        )

    def with_points(self, new: "Appearance") -> "Appearance":
        """These, and new ones after them."""
        return Appearance(
            np.concatenate([self.patches, new.patches]),
            np.concatenate([self.T_start_camera, new.T_start_camera]),
            np.concatenate([self.descriptors, new.descriptors]),
            np.concatenate([self.sought, new.sought]),
            np.concatenate([self.found, new.found]),
            np.concatenate([self.missed, new.missed]),
        )

    def seen_again(self, seen: NDArray[np.bool_], descriptors: Descriptors) -> "Appearance":
        """After a frame in which all were sought, and those `seen` (n,) found looking like that."""
        return Appearance(
            self.patches,
            self.T_start_camera,
            np.where(seen[:, None], descriptors, self.descriptors),
            self.sought + 1,
            self.found + seen,
            np.where(seen, 0, self.missed + 1),
        )


def first_sight(
    image: Image, corners: NDArray[np.int32], descriptors: Descriptors, T_start_camera: Array
) -> Appearance:
    """Of corners (n, 2) at least PATCH_RADIUS from the edge of a smoothed image."""
    n = len(corners)
    offsets = np.arange(-PATCH_RADIUS, PATCH_RADIUS + 1)
    rows = corners[:, 1, None, None] + offsets[:, None]
    columns = corners[:, 0, None, None] + offsets[None, :]
    nothing = np.zeros(n, dtype=np.int64)
    return Appearance(
        image[rows, columns],
        np.repeat(T_start_camera[None], n, axis=0),
        descriptors,
        nothing,
        nothing.copy(),
        nothing.copy(),
    )


def patch_warps(
    appearance: Appearance, points: Array, T_start_camera: Array, camera: StereoCamera
) -> Array:
    """(n, 2, 2) how offsets in each patch appear now, for points (n, 3) in the current camera.

    A point as near as the ground would be where it is seen is taken for a piece of the ground,
    every other one for a wall that faces the camera.
    """
    T_first_now = inverse_transform(appearance.T_start_camera) @ T_start_camera
    R, t = T_first_now[:, :3, :3], T_first_now[:, :3, 3]
    rays = np.column_stack(
        [
            (points[:, 0] - camera.cx) / camera.fx,
            (points[:, 1] - camera.cy) / camera.fy,
            np.ones(len(points)),
        ]
    )
    slopes = _slopes(points, rays, camera)
    first = np.einsum("nij,nj->ni", R, rays) + t * points[:, 2:]
    # Derivative of the point in the first camera by u and v now, along the surface.
    by_u = R[:, :, 0] / camera.fx + t * slopes[:, 0, None]
    by_v = R[:, :, 1] / camera.fy + t * slopes[:, 1, None]
    to_first = np.empty((len(points), 2, 2))
    for column, by in enumerate((by_u, by_v)):
        along = by[:, :2] - first[:, :2] * (by[:, 2:] / first[:, 2:])
        to_first[:, :, column] = along / first[:, 2:] * [camera.fx, camera.fy]
    return _inverse(to_first)


def _slopes(points: Array, rays: Array, camera: StereoCamera) -> Array:
    """(n, 2) how the inverse depth changes along u and v [1/m/px] on the surface of each point."""
    T = camera.T_base_camera
    height = T[2, 3]
    if height <= 0:
        return np.zeros((len(points), 2))
    down = -T[2, :3]
    ground = rays @ down / height  # inverse depth of the robot's own plane along each ray
    on_ground = (ground > 0) & (np.abs(points[:, 2] - ground) < _GROUND_BAND * ground)
    slope = down[:2] / height / [camera.fx, camera.fy]
    return np.where(on_ground[:, None], slope, 0.0)


_GROUND_BAND = 0.2  # of the inverse depth


def _inverse(matrices: Array) -> Array:
    """(n, 2, 2); where there is none, numbers that no patch can be warped by."""
    a, b, c, d = matrices.reshape(-1, 4).T
    determinant = a * d - b * c
    safe = np.where(np.abs(determinant) > 1e-9, determinant, np.inf)
    return np.stack([d, -b, -c, a], axis=-1).reshape(-1, 2, 2) / safe[:, None, None]


NOTHING_SEEN = Appearance(
    np.zeros((0, SIZE, SIZE), dtype=np.uint8),
    np.zeros((0, 4, 4)),
    np.zeros((0, 4), dtype=np.uint64),
    np.zeros(0, dtype=np.int64),
    np.zeros(0, dtype=np.int64),
    np.zeros(0, dtype=np.int64),
)
