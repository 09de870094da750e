"""The faces of boxes."""

import numpy as np
from numpy.typing import NDArray

from grouser.envs.simulation.renderers.faces import (
    Faces,
    brightness,
    decorrelating_offsets,
    make_faces,
)
from grouser.envs.simulation.world import Boxes, Light
from grouser.geometry import Array

# The six faces of the cube [-1, 1]^3: outward normal, then the texture's two axes, with
# right x up = normal. The last is the underside, which shows on what hangs in the air.
_NORMAL = np.array(
    [[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]], dtype=np.float64
)
_RIGHT = np.array(
    [[0, 1, 0], [0, -1, 0], [-1, 0, 0], [1, 0, 0], [1, 0, 0], [1, 0, 0]], dtype=np.float64
)
_UP = np.array([[0, 0, 1]] * 4 + [[0, 1, 0], [0, -1, 0]], dtype=np.float64)
_ALONG = np.array([-1.0, 1.0, 1.0, -1.0])  # of the four corners, counter-clockwise from outside
_ABOVE = np.array([-1.0, -1.0, 1.0, 1.0])

FACES_A_BOX = 6


def box_faces(boxes: Boxes, light: Light, first_object: int) -> Faces:
    """Six faces a box; the boxes are objects first_object, first_object + 1 ..."""
    return oriented_box_faces(
        boxes.centre,
        boxes.half_extents,
        _yaw_rotations(boxes),
        boxes.texture,
        light,
        objects=first_object + np.arange(len(boxes)),
    )


def oriented_box_faces(
    centre: Array,
    half_extents: Array,
    R_world_box: Array,
    texture: NDArray[np.int64],
    light: Light,
    *,
    objects: NDArray[np.int64],
    paint: Array | None = None,
) -> Faces:
    """Six faces a box for boxes (n,) that lie in any direction, R_world_box (n, 3, 3), and whose
    textures are dimmed by a paint (n,) of at most 1."""
    n = len(texture)
    half = half_extents[:, None, None, :]
    unit = _NORMAL[:, None] + _ALONG[:, None] * _RIGHT[:, None] + _ABOVE[:, None] * _UP[:, None]
    corners = np.einsum("bij,bfkj->bfki", R_world_box, unit * half) + centre[:, None, None, :]
    normals = np.einsum("bij,fj->bfi", R_world_box, _NORMAL).reshape(-1, 3)
    metres = np.stack(
        [
            (half * np.abs(_RIGHT)[:, None]).sum(-1) * _ALONG,
            (half * np.abs(_UP)[:, None]).sum(-1) * _ABOVE,
        ],
        axis=-1,
    ).reshape(-1, 4, 2)
    shade = brightness(light, normals)
    if paint is not None:
        shade = shade * np.repeat(paint, FACES_A_BOX)
    return make_faces(
        corners.reshape(-1, 4, 3),
        metres + decorrelating_offsets(FACES_A_BOX * n),
        np.repeat(texture, FACES_A_BOX),
        shade=np.repeat(shade[:, None], 4, axis=1),
        object=np.repeat(objects, FACES_A_BOX),
        surface=np.arange(FACES_A_BOX * n),
        chunk=np.repeat(np.arange(n), FACES_A_BOX),
    )


def _yaw_rotations(boxes: Boxes) -> Array:
    c, s = np.cos(boxes.yaw), np.sin(boxes.yaw)
    R = np.zeros((len(boxes), 3, 3))
    R[:, 0, 0], R[:, 0, 1], R[:, 1, 0], R[:, 1, 1], R[:, 2, 2] = c, -s, s, c, 1
    return R
