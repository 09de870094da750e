"""A rectified stereo pair: two renderers side by side in two threads, then read noise."""

from collections.abc import Mapping, Sequence
from functools import partial

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from grouser.envs.sensors.base import Reading, Sensor
from grouser.envs.sensors.helper_thread import HelperThread
from grouser.envs.sensors.read_noise import ReadNoise
from grouser.envs.simulation.mesh import world_faces
from grouser.envs.simulation.motion import Motion
from grouser.envs.simulation.renderer import Pinhole, Renderer
from grouser.envs.simulation.textures import texture_bank
from grouser.envs.simulation.world import World
from grouser.geometry import Array, transform
from grouser.rig import StereoCamera

EYES = ("left", "right")

Image = NDArray[np.uint8]


class Stereo(Sensor):
    """One or both eyes of a stereo camera.

    Args:
        camera: its calibration.
        eyes: those that are looked through, of EYES; the others are not rendered.
        color: RGB instead of grey.
        noise: standard deviation of the read noise, grey levels.
    """

    def __init__(
        self, camera: StereoCamera, *, eyes: Sequence[str], color: bool, noise: float
    ) -> None:
        self._eyes = tuple(eyes)
        self._color, self._noise = color, ReadNoise(noise)
        self._shape = (camera.height, camera.width, 3 if color else 1)
        self._pinhole = Pinhole(
            camera.width, camera.height, camera.fx, camera.fy, camera.cx, camera.cy
        )
        to_right = transform(np.eye(3), [camera.baseline, 0, 0])
        mounts = {"left": camera.T_base_camera, "right": camera.T_base_camera @ to_right}
        self._mounts = {eye: mounts[eye] for eye in self._eyes}
        self._renderers: dict[str, Renderer] = {}
        self._rngs: dict[str, np.random.Generator] = {}
        self._helper = HelperThread()

    @property
    def spaces(self) -> dict[str, spaces.Box]:
        return {eye: spaces.Box(0, 255, self._shape, np.uint8) for eye in self._eyes}

    def enter(self, world: World, rngs: Mapping[str, np.random.Generator]) -> None:
        faces, bank = world_faces(world), texture_bank(self._color)
        self._rngs = {eye: rngs[eye] for eye in self._eyes}
        self._renderers = {eye: Renderer(faces, self._pinhole, bank) for eye in self._eyes}

    def read(self, motion: Motion) -> Reading:
        *others, last = self._eyes
        T = motion.T_world_base
        pending = {eye: self._helper.submit(partial(self._look, eye, T)) for eye in others}
        image = self._look(last, T)
        return {**{eye: future.result() for eye, future in pending.items()}, last: image}

    def close(self) -> None:
        self._helper.close()
        self._renderers = {}

    def _look(self, eye: str, T_world_base: Array) -> Image:
        image = self._renderers[eye].render(T_world_base @ self._mounts[eye])
        return self._noise.add(image, self._rngs[eye])
