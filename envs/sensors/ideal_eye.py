"""What the left eye of a stereo camera would see without noise or faults: depth and objects."""

import numpy as np
from numpy.typing import NDArray

from grouser.envs.sensors.stereo import pinhole
from grouser.envs.simulation.motion import Motion
from grouser.envs.simulation.renderers.base import Renderer
from grouser.envs.simulation.renderers.registry import make_renderer
from grouser.envs.simulation.world import World
from grouser.rig import StereoCamera


class IdealEye:
    """Looks into one world at a time, with a renderer that is made at the first look.

    Args:
        camera: of which it is the left eye.
        renderer: of RENDERERS.
    """

    def __init__(self, camera: StereoCamera, renderer: str) -> None:
        self._camera, self._name = camera, renderer
        self._looking: tuple[World, Renderer] | None = None

    def depth(self, world: World, motion: Motion) -> NDArray[np.float32]:
        """(H, W) along the optical axis, m; inf for the sky."""
        return self._renderer(world).depth(motion.T_world_base @ self._camera.T_base_camera)

    def segmentation(self, world: World, motion: Motion) -> NDArray[np.int32]:
        """(H, W) objects as `Renderer.segmentation` numbers them."""
        return self._renderer(world).segmentation(motion.T_world_base @ self._camera.T_base_camera)

    def close(self) -> None:
        """Free the renderer; a second call does nothing."""
        if self._looking is not None:
            self._looking[1].close()
        self._looking = None

    def _renderer(self, world: World) -> Renderer:
        if self._looking is None or self._looking[0] is not world:
            self.close()
            made = make_renderer(self._name, world, pinhole(self._camera), color=False)
            self._looking = world, made
        return self._looking[1]
