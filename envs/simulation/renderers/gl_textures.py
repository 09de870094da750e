"""The texture bank in OpenGL: one array, which all worlds of a process share."""

from functools import cache
from typing import Any

import moderngl
import numpy as np

from grouser.envs.simulation.materials import TEXTURES
from grouser.envs.simulation.renderers.gl_context import shared_context
from grouser.envs.simulation.renderers.textures import texture_bank


@cache
def texture_array(color: bool) -> Any:
    """The `moderngl.TextureArray` of every texture with its mip-maps; smaller textures repeat in
    their layer, so that all are of one size."""
    bank = texture_bank(color)
    largest = int(bank.sizes.max())
    layers = []
    for k in range(len(TEXTURES)):
        repeats = largest // int(bank.sizes[k])
        layers.append(np.tile(bank.level(k, 0), (repeats, repeats, 1)))
    array = shared_context().texture_array(
        (largest, largest, len(layers)), bank.channels, np.stack(layers).tobytes()
    )
    if not color:
        array.swizzle = "RRR1"
    array.build_mipmaps()
    array.filter = (moderngl.LINEAR_MIPMAP_LINEAR, moderngl.LINEAR)
    return array
