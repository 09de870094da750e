"""Procedural textures: tileable, seeded, rich in corners, with mip-maps.

Every world draws on the same bank, which is built once a process (about 0.3 s): worlds differ by
what stands where, not by the grain of its gravel, and a reset costs no texture.
"""

from collections.abc import Sequence
from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from grouser.envs.simulation.materials import TEXTURES
from grouser.envs.simulation.renderers import grains
from grouser.envs.simulation.renderers.grains import Image

METRES_PER_TEXEL = 1 / 256
"""One size of texel for all textures, m."""

_SEED = 20
_TINTS = (
    (1, 0.95, 0.85),
    (1, 0.75, 0.65),
    (0.9, 1, 0.9),
    (0.85, 0.92, 1),
    (1, 1, 0.8),
    (0.95,) * 3,
    (0.9, 0.92, 1),
    (0.75, 1, 0.45),
    (1, 0.8, 0.6),
    (0.9, 0.97, 1),
    (1, 0.85, 0.65),
    (0.6, 1, 0.45),
)
LUMA = np.array([0.299, 0.587, 0.114])


class TextureBank(NamedTuple):
    """Every texture of TEXTURES at every scale, in one flat array, as kernels take it."""

    texels: NDArray[np.uint32]
    """Flat; a level of side n holds n * n * channels values in the order row, column, channel.
    Each holds, from its lowest byte on, a texel and those to its right, above it, and above that
    to its right: all that bilinear sampling needs comes with one load."""
    offsets: NDArray[np.int32]
    """(texture, level): where the level begins in `texels`; level k has side sizes >> k."""
    sizes: NDArray[np.int32]
    """(texture,) side of level 0, texels: a power of two."""
    channels: int

    def level(self, texture: int, level: int) -> NDArray[np.uint8]:
        """(side, side, channels) one level of a texture."""
        side, start = int(self.sizes[texture]) >> level, int(self.offsets[texture, level])
        packed = self.texels[start : start + side * side * self.channels]
        return (packed & 255).astype(np.uint8).reshape(side, side, self.channels)


@cache
def texture_bank(color: bool) -> TextureBank:
    """The bank, grey or RGB, built at the first call."""
    tinted = [grey[..., None] * np.array(tint) for grey, tint in zip(_greys(), _TINTS, strict=True)]
    images = tinted if color else [(rgb @ LUMA)[..., None] for rgb in tinted]
    return make_bank([pyramid(np.clip(image, 0, 255)) for image in images])


def texture_metres() -> NDArray[np.float64]:
    """(texture,) side of one tile of each texture on the ground or a wall, m."""
    return np.asarray(texture_bank(False).sizes * METRES_PER_TEXEL, dtype=np.float64)


def texture_colours() -> NDArray[np.float64]:
    """(texture, 3) mean colour of each texture, RGB from 0 to 255."""
    bank = texture_bank(True)
    last = np.log2(bank.sizes).astype(np.int64)
    return np.array([bank.level(k, level)[0, 0] for k, level in enumerate(last)], dtype=np.float64)


@cache
def _greys() -> list[Image]:
    rngs = dict(zip(TEXTURES, np.random.default_rng(_SEED).spawn(len(TEXTURES)), strict=True))
    return [
        grains.stones(
            rngs["gravel"], size=1024, cells=96
        ),  # twice as large: the ground repeats most
        grains.bricks(rngs["brick"], size=512, rows=16, columns=8),
        grains.grain(rngs["plaster"], size=512),
        grains.stones(rngs["pebbles"], size=512, cells=20),
        grains.bricks(rngs["blocks"], size=512, rows=8, columns=4),
        grains.grain(rngs["concrete"], size=512),
        grains.stones(rngs["asphalt"], size=512, cells=128, tones=(45, 150), gap=1.5),
        grains.blades(rngs["grass"], size=512, count=6000, length=28),
        grains.wet(rngs["mud"], size=512),
        grains.frozen(rngs["ice"], size=512),
        grains.furrows(rngs["bark"], size=512),
        grains.leaves(rngs["foliage"], size=512, count=2200, length=34),
    ]


def make_bank(pyramids: Sequence[Sequence[Image]]) -> TextureBank:
    """A bank of textures, each of all its levels (n, n, channels), (n / 2, n / 2, channels) ... of
    values 0 to 255; n is a power of two."""
    offsets = np.zeros((len(pyramids), max(len(p) for p in pyramids)), dtype=np.int32)
    start = 0
    for i, levels in enumerate(pyramids):
        for k, level in enumerate(levels):
            offsets[i, k] = start
            start += level.size
    return TextureBank(
        texels=np.concatenate([_packed(level).ravel() for levels in pyramids for level in levels]),
        offsets=offsets,
        sizes=np.array([levels[0].shape[0] for levels in pyramids], dtype=np.int32),
        channels=pyramids[0][0].shape[2],
    )


def _packed(level: Image) -> NDArray[np.uint32]:
    """Every texel with its three neighbours, as TextureBank says."""
    texel = np.round(level).astype(np.uint32)
    pair = texel + np.roll(texel, -1, axis=1) * np.uint32(1 << 8)
    return np.asarray(pair + np.roll(pair, -1, axis=0) * np.uint32(1 << 16), dtype=np.uint32)


def pyramid(image: Image) -> list[Image]:
    """The image, halved by box filter down to one texel."""
    levels = [image]
    while levels[-1].shape[0] > 1:
        fine = levels[-1]
        levels.append((fine[::2, ::2] + fine[1::2, ::2] + fine[::2, 1::2] + fine[1::2, 1::2]) / 4)
    return levels
