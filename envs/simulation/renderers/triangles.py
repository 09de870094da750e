"""A mesh as a list of triangles, as graphics hardware takes it."""

import numpy as np
from numpy.typing import NDArray

from grouser.envs.simulation.renderers.faces import Faces
from grouser.envs.simulation.renderers.level_ground import GROUND_OBJECT
from grouser.envs.simulation.renderers.mesh import Mesh
from grouser.envs.simulation.renderers.relief import Relief
from grouser.envs.simulation.renderers.textures import texture_metres

Vertices = NDArray[np.float32]
"""(3 n, 8): position [m] (3), texture coordinates [tiles] (2), brightness, texture, object."""


def mesh_triangles(mesh: Mesh) -> Vertices:
    """Three vertices a triangle, counter-clockwise from the side that shows."""
    return np.concatenate([_face_triangles(mesh.faces), _relief_triangles(mesh.relief)])


def _face_triangles(faces: Faces) -> Vertices:
    shade = faces.shade[:, :1] + np.einsum("fq,fkq->fk", faces.shade[:, 1:], faces.uv)
    labels = np.stack([faces.texture, faces.object], axis=-1)[:, None].repeat(4, axis=1)
    corners = np.concatenate([faces.corners, faces.uv, shade[..., None], labels], axis=-1)
    return corners[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 8).astype(np.float32)


def _relief_triangles(relief: Relief) -> Vertices:
    """Each cell is split from its lower left to its upper right corner."""
    rows, columns = relief.texture.shape
    r, c = (a.ravel()[:, None] for a in np.indices((rows, columns)))
    r, c = r + np.array([0, 0, 1, 0, 1, 1]), c + np.array([0, 1, 1, 0, 1, 0])
    texture = relief.texture.reshape(-1, 1).repeat(6, axis=1)
    x, y = relief.origin[0] + relief.cell * c, relief.origin[1] + relief.cell * r
    tile = texture_metres()[texture]
    return np.stack(
        [
            x, y, relief.heights[r, c], x / tile, y / tile, relief.shade[r, c], texture,
            np.full(texture.shape, GROUND_OBJECT),
        ],
        axis=-1,
    ).reshape(-1, 8).astype(np.float32)  # fmt: skip
