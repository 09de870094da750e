"""The renderer for graphics hardware, or Mesa's software driver: OpenGL by moderngl, off screen."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from grouser.envs.simulation.renderers.base import Image, Renderer
from grouser.envs.simulation.renderers.gl_context import is_software, shared_context
from grouser.envs.simulation.renderers.mesh import world_mesh
from grouser.envs.simulation.renderers.pinhole import Pinhole
from grouser.envs.simulation.world import World
from grouser.geometry import Array

if TYPE_CHECKING:
    from grouser.envs.simulation.renderers.gl_drawing import GlDrawing


class OpenGlRenderer(Renderer):
    """Draws two pictures at once. It touches OpenGL when it first draws, not before, so that an
    environment may be made in one process and stepped in another.

    Raises, when it first draws:
        ImportError: moderngl is not installed.
        RuntimeError: a system library is missing, or the process was forked after one had drawn.
    """

    def __init__(self, world: World, camera: Pinhole, *, color: bool) -> None:
        self._world, self._camera, self._color = world, camera, color
        self._made: GlDrawing | None = None

    def images(self, poses: Sequence[Array]) -> list[Image]:
        pairs = [poses[k : k + 2] for k in range(0, len(poses), 2)]
        return [image for pair in pairs for image in self._drawing().images(pair)]

    def depth(self, T_world_camera: Array) -> NDArray[np.float32]:
        depth = self._drawing().measure(T_world_camera)[..., 0]
        return np.where(depth > 0, depth, np.float32(np.inf))

    def segmentation(self, T_world_camera: Array) -> NDArray[np.int32]:
        return np.round(self._drawing().measure(T_world_camera)[..., 1]).astype(np.int32)

    def close(self) -> None:
        if self._made is not None:
            self._made.release()
        self._made = None

    def _drawing(self) -> "GlDrawing":
        if self._made is None:
            shared_context()  # says what is missing
            from grouser.envs.simulation.renderers.gl_drawing import GlDrawing

            self._made = GlDrawing(
                world_mesh(self._world), self._camera, color=self._color, quick=is_software()
            )
        return self._made
