"""Small scenes for tests of renderers."""

import numpy as np
from numpy.typing import NDArray

from grouser.envs.simulation.ground import Ground
from grouser.envs.simulation.renderers.faces import Faces
from grouser.envs.simulation.renderers.mesh import Mesh
from grouser.envs.simulation.renderers.pinhole import Pinhole
from grouser.envs.simulation.renderers.relief import relief_of
from grouser.envs.simulation.renderers.textures import TextureBank, make_bank, pyramid
from grouser.envs.simulation.world import Boxes, Light
from grouser.geometry import Array, inverse_transform

SKY = 198
"""Grey level of the default sky."""


def mesh_of(faces: Faces) -> Mesh:
    """These faces and nothing else."""
    return Mesh(faces, relief_of(Ground.flat(1.0), Light()), Light())


def quadrilateral(corners: Array, tiles: float = 1.0, shade: float = 1.0) -> Faces:
    """One face (4, 3), with so many tiles of texture 0 along it and across."""
    uv = tiles * np.array([[[0, 0], [1, 0], [1, 1], [0, 1]]], dtype=np.float64)
    zero = np.zeros(1, dtype=np.int32)
    lit = np.array([[shade, 0, 0]], dtype=np.float32)
    return Faces(np.asarray(corners, dtype=np.float64)[None], uv, lit, zero, zero, zero, zero)


def bank_of(image: NDArray[np.uint8]) -> TextureBank:
    """A bank of one square texture (n, n) and its box-filtered levels."""
    return make_bank([pyramid(image[..., None].astype(np.float64))])


def one_box(x: float, y: float, yaw: float, half: tuple[float, float, float]) -> Boxes:
    """A box that stands on the ground, of texture 0."""
    return Boxes(np.array([[x, y, half[2]]]), np.array([half]), np.array([yaw]), np.array([0]))


def pixels(points: Array, T_world_camera: Array, camera: Pinhole) -> Array:
    """Analytic pixels (n, 2) of points (n, 3) in the world."""
    T = inverse_transform(T_world_camera)
    p = points @ T[:3, :3].T + T[:3, 3]
    x, y = camera.fx * p[:, 0] / p[:, 2], camera.fy * p[:, 1] / p[:, 2]
    return np.stack([x + camera.cx, y + camera.cy], axis=-1)
