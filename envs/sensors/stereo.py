"""A rectified stereo pair: what a renderer draws from both eyes, then read noise."""

from collections.abc import Mapping, Sequence

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from grouser.envs.sensors.base import Reading, Sensor
from grouser.envs.sensors.read_noise import add_read_noise
from grouser.envs.simulation.motion import Motion
from grouser.envs.simulation.renderers.base import Renderer
from grouser.envs.simulation.renderers.pinhole import Pinhole
from grouser.envs.simulation.renderers.registry import make_renderer
from grouser.envs.simulation.world import World
from grouser.geometry import transform
from grouser.rig import StereoCamera

EYES = ("left", "right")

Image = NDArray[np.uint8]


class Stereo(Sensor):
    """One or both eyes of a stereo camera.

    Args:
        camera: its calibration.
        eyes: those that are looked through, of EYES; the others are not rendered.
        color: RGB instead of grey.
        dt: length of a control step, s.
        renderer: of RENDERERS.
    """

    def __init__(
        self,
        camera: StereoCamera,
        *,
        eyes: Sequence[str],
        color: bool,
        dt: float,
        renderer: str = "raster",
    ) -> None:
        self._eyes = tuple(eyes)
        self._color, self._renderer_name, self._dt = color, renderer, dt
        self._shape = (camera.height, camera.width, 3 if color else 1)
        self._pinhole = Pinhole(
            camera.width, camera.height, camera.fx, camera.fy, camera.cx, camera.cy
        )
        to_right = transform(np.eye(3), [camera.baseline, 0, 0])
        mounts = {"left": camera.T_base_camera, "right": camera.T_base_camera @ to_right}
        self._mounts = {eye: mounts[eye] for eye in self._eyes}
        self._renderer: Renderer | None = None

    @property
    def spaces(self) -> dict[str, spaces.Box]:
        return {eye: spaces.Box(0, 255, self._shape, np.uint8) for eye in self._eyes}

    def enter(self, world: World, rngs: Mapping[str, np.random.Generator]) -> None:
        self.close()
        self._memory = {eye: rngs[eye] for eye in self._eyes}
        self._renderer = make_renderer(self._renderer_name, world, self._pinhole, color=self._color)

    def read(self, motion: Motion, amounts: Mapping[str, float]) -> Reading:
        assert self._renderer is not None
        images = self._renderer.images([motion.T_world_base @ self._mounts[e] for e in self._eyes])
        return {
            eye: add_read_noise(image, amounts[f"{eye}.read_noise"], self._memory[eye])
            for eye, image in zip(self._eyes, images, strict=True)
        }

    def close(self) -> None:
        if self._renderer is not None:
            self._renderer.close()
        self._renderer = None
