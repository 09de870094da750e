"""The colour of every pixel, row by row: collect what it shows, sample the textures, add up."""

from typing import Any

import numpy as np

from grouser.envs.simulation.renderers.fragments import collect
from grouser.envs.simulation.renderers.sampling import ONE, sample
from grouser.kernels import kernel, kernel_using

F = np.float32


@kernel_using(collect, sample)
def resolve(
    visible: Any,
    faces: Any,
    subsamples: Any,
    bank: Any,
    anisotropy: Any,
    sky: Any,
    fragments: Any,
    image: Any,
) -> None:
    """Colour an image.

    Args:
        visible: a `Visible`.
        faces: (S, height, width), from `cover`.
        subsamples: (S, 2) float32 of SUBSAMPLES.
        bank: a `TextureBank`.
        anisotropy: float32, most taps along a footprint's longer axis.
        sky: a `Sky`.
        fragments: room for those of a row.
        image: out, (height, width, channels) uint8.
    """
    height, width, channels = image.shape
    colours = np.empty((channels, width), dtype=np.float32)
    for y in range(height):
        n = collect(visible, faces, subsamples, bank, anisotropy, y, fragments)
        sample(bank, fragments, n)
        _add_up(sky, y, fragments, n, colours)
        for q in range(channels):
            for x in range(width):
                level = colours[q, x] + F(0.5)
                image[y, x, q] = np.uint8(min(max(level, F(0)), F(255)))


@kernel
def _add_up(sky: Any, y: int, fragments: Any, n: int, colours: Any) -> None:
    """(channels, width) the sky's share and that of every fragment."""
    for q in range(colours.shape[0]):
        colour, total = colours[q], fragments.total[q]
        for x in range(colour.size):
            up = sky.up[0] * F(np.int32(x)) + (sky.up[1] * F(y) + sky.up[2])
            up = up * sky.inverse_length[y, x]
            up = up if up > F(0) else F(0)
            colour[x] = fragments.sky[x] * (sky.horizon[q] + up * sky.rise[q])
        for k in range(n):
            colour[fragments.pixel[k]] += fragments.gain[k] * (F(total[k]) * F(1 / ONE))
