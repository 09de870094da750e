"""The rasteriser: a picture of a set of faces from a pinhole camera.

Project, cover, resolve: one kernel each. Only + - * / sqrt and floor on IEEE floats, so the
pixels depend neither on the processor nor on the number of threads.
"""

import numpy as np
from numpy.typing import NDArray

from grouser.envs.simulation.renderers.base import NEAR
from grouser.envs.simulation.renderers.coverage import SUBSAMPLES, cover
from grouser.envs.simulation.renderers.mesh import Faces
from grouser.envs.simulation.renderers.pinhole import Pinhole
from grouser.envs.simulation.renderers.projection import MAX_CORNERS, N_PLANES, project_faces
from grouser.envs.simulation.renderers.sampling import resolve
from grouser.envs.simulation.renderers.textures import TextureBank
from grouser.geometry import Array

SKY_COLOUR = {1: (200.0,), 3: (176.0, 203.0, 230.0)}
"""Grey levels, by number of channels."""


class Rasteriser:
    """Draws one set of faces from one camera; not for two threads at a time.

    Args:
        faces: what there is to see.
        camera: its intrinsics.
        bank: the textures; its channels say whether images are grey or RGB.
        samples: sub-samples a pixel, 1 or 4.
        anisotropy: most texture samples along a footprint's longer axis.
    """

    def __init__(
        self,
        faces: Faces,
        camera: Pinhole,
        bank: TextureBank,
        *,
        samples: int = 4,
        anisotropy: int = 2,
    ) -> None:
        self._faces, self._camera, self._anisotropy = faces, camera, anisotropy
        self._bank = bank
        self._sky = np.array(SKY_COLOUR[bank.channels], dtype=np.float32)
        self._intrinsics = np.array([camera.fx, camera.fy, camera.cx, camera.cy])
        self._size = np.array([camera.width, camera.height])
        self._subsamples = SUBSAMPLES[samples]
        shape = (camera.height, camera.width)
        self._depth = np.empty(shape, dtype=np.float32)
        self._seen = np.empty((samples, *shape), dtype=np.int32)
        self._polygons = np.empty((len(faces), MAX_CORNERS, 2))
        self._n_corners = np.empty(len(faces), dtype=np.int64)
        self._planes = np.zeros((len(faces), N_PLANES))

    def render(self, T_world_camera: Array) -> NDArray[np.uint8]:
        """A new image (height, width, 1 or 3) from the camera's pose (4, 4)."""
        image = np.empty((*self._seen.shape[1:], self._bank.channels), dtype=np.uint8)
        self._project(np.ascontiguousarray(T_world_camera))
        self._cover()
        self._resolve(image)
        return image

    def _project(self, T_world_camera: Array) -> None:
        project_faces(
            self._faces.corners, self._faces.uv, T_world_camera, self._intrinsics, self._size, NEAR,
            self._polygons, self._n_corners, self._planes,
        )  # fmt: skip

    def _cover(self) -> None:
        for (dx, dy), seen in zip(self._subsamples.tolist(), self._seen, strict=True):
            cover(self._polygons, self._n_corners, self._planes, dx, dy, self._depth, seen)

    def _resolve(self, image: NDArray[np.uint8]) -> None:
        resolve(
            self._planes.astype(np.float32), self._faces.texture, self._faces.shade, self._seen,
            self._subsamples, self._bank, self._anisotropy, self._sky, image,
        )  # fmt: skip
