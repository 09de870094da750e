"""The faces of a world, as the rasteriser wants them: textured quadrilaterals in a fixed light."""

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from grouser.envs.simulation.renderers.textures import texture_metres
from grouser.envs.simulation.world import Boxes, World
from grouser.geometry import Array

_LIGHT = np.array([0.40, 0.25, 0.88]) / np.linalg.norm([0.40, 0.25, 0.88])
_AMBIENT, _DIRECT = 0.55, 0.45

# The five visible faces of the cube [-1, 1]^3: outward normal, then the texture's two axes, with
# right x up = normal. Undersides are never seen.
_NORMAL = np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1]], dtype=np.float64)
_RIGHT = np.array([[0, 1, 0], [0, -1, 0], [-1, 0, 0], [1, 0, 0], [1, 0, 0]], dtype=np.float64)
_UP = np.array([[0, 0, 1]] * 4 + [[0, 1, 0]], dtype=np.float64)
_ALONG = np.array([-1.0, 1.0, 1.0, -1.0])  # of the four corners, counter-clockwise from outside
_ABOVE = np.array([-1.0, -1.0, 1.0, 1.0])


@dataclass(frozen=True, slots=True, eq=False)
class Faces:
    """n flat quadrilaterals, counter-clockwise seen from the side that shows."""

    corners: Array
    """(n, 4, 3) m, in the world frame."""
    uv: Array
    """(n, 4, 2) texture coordinates of the corners, in tiles; affine on the face."""
    shade: NDArray[np.float32]
    """(n,) brightness by the light, at most 1."""
    texture: NDArray[np.int64]
    """(n,)"""

    def __len__(self) -> int:
        return len(self.shade)


def join_faces(*parts: Faces) -> Faces:
    """The faces of all parts, in order."""
    return Faces(
        *(np.concatenate([getattr(part, f.name) for part in parts]) for f in fields(Faces))
    )


def world_faces(world: World) -> Faces:
    """The ground and every visible side of what stands on it."""
    return join_faces(_ground_face(world), box_faces(world.solids))


def box_faces(boxes: Boxes) -> Faces:
    """Five faces a box (not the underside)."""
    return oriented_box_faces(
        boxes.centre, boxes.half_extents, _yaw_rotations(boxes), boxes.texture, np.ones(len(boxes))
    )


def oriented_box_faces(
    centre: Array,
    half_extents: Array,
    R_world_box: Array,
    texture: NDArray[np.int64],
    brightness: Array,
) -> Faces:
    """Five faces a box for boxes (n,) that lie in any direction, R_world_box (n, 3, 3), and whose
    textures are dimmed to a brightness (n,) of at most 1."""
    n = len(texture)
    half = half_extents[:, None, None, :]
    unit = _NORMAL[:, None] + _ALONG[:, None] * _RIGHT[:, None] + _ABOVE[:, None] * _UP[:, None]
    corners = np.einsum("bij,bfkj->bfki", R_world_box, unit * half) + centre[:, None, None, :]
    normals = np.einsum("bij,fj->bfi", R_world_box, _NORMAL).reshape(-1, 3)
    face_texture = np.repeat(texture, 5)
    metres = np.stack(
        [
            (half * np.abs(_RIGHT)[:, None]).sum(-1) * _ALONG,
            (half * np.abs(_UP)[:, None]).sum(-1) * _ABOVE,
        ],
        axis=-1,
    ).reshape(-1, 4, 2)
    uv = metres / texture_metres()[face_texture, None, None] + _decorrelating_offsets(5 * n)
    shade = _shade(normals) * np.repeat(brightness, 5).astype(np.float32)
    return Faces(corners.reshape(-1, 4, 3), uv, shade, face_texture)


def _ground_face(world: World) -> Faces:
    ground = world.ground
    g = ground.cell / 2
    corners = np.stack([g * _ALONG, g * _ABOVE, np.zeros(4)], axis=-1)[None]
    texture = ground.textures[ground.material.ravel()]
    uv = corners[..., :2] / texture_metres()[texture]
    return Faces(corners, uv, _shade(np.array([[0.0, 0.0, 1.0]])), texture)


def _shade(normals: Array) -> NDArray[np.float32]:
    """Ambient plus Lambert's cosine law for one distant light."""
    shade = _AMBIENT + _DIRECT * np.clip(normals @ _LIGHT, 0, 1)
    return np.asarray(shade, dtype=np.float32)


def _decorrelating_offsets(n: int) -> Array:
    """(n, 1, 2) shifts of the texture, so that no two faces show the same pattern at a corner."""
    steps = np.array([0.7548776662466927, 0.5698402909980532])  # the R2 low-discrepancy sequence
    return np.asarray(np.mod(np.arange(1, n + 1)[:, None, None] * steps, 1.0))


def _yaw_rotations(boxes: Boxes) -> Array:
    c, s = np.cos(boxes.yaw), np.sin(boxes.yaw)
    R = np.zeros((len(boxes), 3, 3))
    R[:, 0, 0], R[:, 0, 1], R[:, 1, 0], R[:, 1, 1], R[:, 2, 2] = c, -s, s, c, 1
    return R
