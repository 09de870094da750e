"""The rasteriser: pictures of a mesh from a pinhole camera.

Project, then draw row by row: a kernel each. Only whole numbers and + - * / sqrt and floor on IEEE
floats, so the pixels depend neither on the processor nor on the number of threads.
"""

import numpy as np
from numpy.typing import NDArray

from grouser.envs.simulation.renderers.base import NEAR, Image
from grouser.envs.simulation.renderers.coverage import SUBSAMPLES
from grouser.envs.simulation.renderers.drawing import draw, look, room_for_row
from grouser.envs.simulation.renderers.mesh import SKY_OBJECT, Mesh
from grouser.envs.simulation.renderers.pinhole import Pinhole
from grouser.envs.simulation.renderers.projection import View, project_faces
from grouser.envs.simulation.renderers.relief_projection import project_relief
from grouser.envs.simulation.renderers.sky import make_sky
from grouser.envs.simulation.renderers.textures import METRES_PER_TEXEL, TextureBank
from grouser.envs.simulation.renderers.visible import room_for
from grouser.geometry import Array


class Rasteriser:
    """Draws one mesh through one camera; not for two threads at a time.

    Args:
        mesh: what there is to see.
        camera: its intrinsics.
        bank: the textures; its channels say whether images are grey or RGB.
        samples: sub-samples a pixel, 1 or 4.
        anisotropy: most texture samples along a footprint's longer axis.
    """

    def __init__(
        self,
        mesh: Mesh,
        camera: Pinhole,
        bank: TextureBank,
        *,
        samples: int = 4,
        anisotropy: int = 2,
    ) -> None:
        faces = mesh.faces
        self._mesh, self._camera, self._bank = mesh, camera, bank
        self._anisotropy = np.float32(anisotropy)
        self._labels = np.stack([faces.texture, faces.object, faces.surface], axis=-1)
        self._chunks = mesh.chunks()
        self._tiles = bank.sizes * METRES_PER_TEXEL
        self._sky = make_sky(mesh.light, camera, channels=bank.channels)
        self._subsamples = SUBSAMPLES[samples]
        self._room = room_for_row(camera.width, samples, bank.channels)
        self._visible = room_for(len(faces) + 2 * mesh.relief.texture.size)

    def render(self, T_world_camera: Array) -> Image:
        """A new image (height, width, 1 or 3) from the camera's pose (4, 4)."""
        camera, bank = self._camera, self._bank
        image = np.empty((camera.height, camera.width, bank.channels), dtype=np.uint8)
        sky = self._sky.seen_from(camera, T_world_camera)
        draw(
            self._visible, self._project(T_world_camera), self._subsamples, bank,
            self._anisotropy, sky, self._room, image,
        )  # fmt: skip
        return image

    def depth(self, T_world_camera: Array) -> NDArray[np.float32]:
        """(height, width) m along the optical axis, at the first sub-sample; inf for sky."""
        return self._look(T_world_camera)[0]

    def segmentation(self, T_world_camera: Array) -> NDArray[np.int32]:
        """(height, width) objects at the first sub-sample; SKY_OBJECT where there is none."""
        seen = self._look(T_world_camera)[1]
        return np.where(seen >= 0, self._visible.object[seen], np.int32(SKY_OBJECT))

    def _look(self, T_world_camera: Array) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
        """(height, width) depth, and which polygon is seen."""
        shape = self._camera.height, self._camera.width
        depth, seen = np.empty(shape, dtype=np.float32), np.empty(shape, dtype=np.int32)
        n = self._project(T_world_camera)
        look(self._visible, n, self._subsamples, self._room, depth, seen)
        return depth, seen

    def _project(self, T_world_camera: Array) -> int:
        """How many polygons may be seen."""
        view, faces, visible = self._view(T_world_camera), self._mesh.faces, self._visible
        n = project_faces(
            faces.corners, faces.uv, faces.shade, self._labels, self._chunks, view, visible, 0
        )
        return int(project_relief(self._mesh.relief, self._tiles, view, visible, n))

    def _view(self, T_world_camera: Array) -> View:
        c = self._camera
        return View(
            T_world_camera=np.ascontiguousarray(T_world_camera),
            intrinsics=np.array([c.fx, c.fy, c.cx, c.cy]),
            size=np.array([c.width, c.height], dtype=np.float64),
            near=NEAR,
            samples_a_pixel=float(len(self._subsamples)),
        )
