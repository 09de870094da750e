"""The sky: from the horizon's colour to the zenith's, by the sine of a ray's elevation."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from grouser.envs.simulation.renderers.pinhole import Pinhole
from grouser.envs.simulation.renderers.textures import LUMA
from grouser.envs.simulation.world import Light
from grouser.geometry import Array


class Sky(NamedTuple):
    """The sky before a camera at a pose, as kernels take it."""

    horizon: NDArray[np.float32]
    """(channels,) grey levels."""
    rise: NDArray[np.float32]
    """(channels,) the zenith's less the horizon's."""
    up: NDArray[np.float32]
    """(3,) the vertical part of a pixel's ray is up . (x, y, 1)."""
    inverse_length: NDArray[np.float32]
    """(height, width) 1 / length of the pixel's ray."""

    def seen_from(self, camera: Pinhole, T_world_camera: Array) -> "Sky":
        """The same sky before a turned camera."""
        x, y, z = T_world_camera[2, :3]
        kx, ky = x / camera.fx, y / camera.fy
        up = [kx, ky, z - kx * camera.cx - ky * camera.cy]
        return self._replace(up=np.array(up, dtype=np.float32))


def make_sky(light: Light, camera: Pinhole, *, channels: int) -> Sky:
    """The sky of a light before an upright camera."""
    horizon, zenith = sky_colours(light, channels)
    x = (np.arange(camera.width) - camera.cx) / camera.fx
    y = (np.arange(camera.height) - camera.cy) / camera.fy
    inverse_length = 1 / np.sqrt(x**2 + y[:, None] ** 2 + 1)
    return Sky(
        horizon.astype(np.float32),
        (zenith - horizon).astype(np.float32),
        np.array([0, 0, 1], dtype=np.float32),
        inverse_length.astype(np.float32),
    )


def sky_colours(light: Light, channels: int) -> tuple[Array, Array]:
    """(channels,) of the horizon and of the zenith, grey levels; grey is the luma of the RGB."""
    if channels == 3:
        return light.horizon, light.zenith
    return np.array([light.horizon @ LUMA]), np.array([light.zenith @ LUMA])
