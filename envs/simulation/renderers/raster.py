"""The default renderer: our own rasteriser, the same bits everywhere, on two threads."""

import os
from collections.abc import Sequence
from functools import cache

import numpy as np
from numpy.typing import NDArray

from grouser.envs.simulation.renderers.base import Image, Renderer
from grouser.envs.simulation.renderers.helper_thread import HelperThread
from grouser.envs.simulation.renderers.mesh import world_mesh
from grouser.envs.simulation.renderers.pinhole import Pinhole
from grouser.envs.simulation.renderers.rasteriser import Rasteriser
from grouser.envs.simulation.renderers.textures import texture_bank
from grouser.envs.simulation.world import World
from grouser.geometry import Array


class RasterRenderer(Renderer):
    """Draws every second picture in a second thread, where there is a second processor."""

    def __init__(self, world: World, camera: Pinhole, *, color: bool) -> None:
        mesh, bank = world_mesh(world), texture_bank(color)
        self._own, self._other = (Rasteriser(mesh, camera, bank) for _ in range(2))
        self._at_centres = cache(lambda: Rasteriser(mesh, camera, bank, samples=1))
        self._helper = HelperThread()

    def images(self, poses: Sequence[Array]) -> list[Image]:
        if _on_one_processor() or len(poses) < 2:
            return _draw(self._own, poses)
        pending = self._helper.submit(lambda: _draw(self._other, poses[1::2]))
        drawn = _draw(self._own, poses[::2]), pending.result()
        return [drawn[i % 2][i // 2] for i in range(len(poses))]

    def depth(self, T_world_camera: Array) -> NDArray[np.float32]:
        return self._at_centres().depth(T_world_camera)

    def segmentation(self, T_world_camera: Array) -> NDArray[np.int32]:
        return self._at_centres().segmentation(T_world_camera)

    def close(self) -> None:
        self._helper.close()


def _draw(rasteriser: Rasteriser, poses: Sequence[Array]) -> list[Image]:
    return [rasteriser.render(T) for T in poses]


def _on_one_processor() -> bool:
    """Whether this process keeps to a single processor, as the workers of a vector may."""
    return hasattr(os, "sched_getaffinity") and len(os.sched_getaffinity(0)) == 1
