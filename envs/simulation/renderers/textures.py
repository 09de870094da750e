"""Procedural textures: tileable, seeded, rich in corners, with mip-maps.

Every world draws on the same bank, which is built once a process (about 0.3 s): worlds differ by
what stands where, not by the grain of its gravel, and a reset costs no texture.
"""

from collections.abc import Sequence
from functools import cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from grouser.envs.simulation.materials import TEXTURES
from grouser.kernels import kernel

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

Image = NDArray[np.float64]


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


@cache
def _greys() -> list[Image]:
    rngs = dict(zip(TEXTURES, np.random.default_rng(_SEED).spawn(len(TEXTURES)), strict=True))
    return [
        _stones(rngs["gravel"], size=1024, cells=96),  # twice as large: the ground repeats most
        _bricks(rngs["brick"], size=512, rows=16, columns=8),
        _grain(rngs["plaster"], size=512),
        _stones(rngs["pebbles"], size=512, cells=20),
        _bricks(rngs["blocks"], size=512, rows=8, columns=4),
        _grain(rngs["concrete"], size=512),
        _stones(rngs["asphalt"], size=512, cells=96),
        _grain(rngs["grass"], size=512),
        _grain(rngs["mud"], size=512),
        _grain(rngs["ice"], size=512),
        _bricks(rngs["bark"], size=512, rows=8, columns=16),
        _stones(rngs["foliage"], size=512, cells=48),
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


# --- the grains ----------------------------------------------------------------------------------


def _coloured_noise(rng: np.random.Generator, size: int, slope: float, lowest: float) -> Image:
    """Periodic noise of variance 1, amplitude spectrum f^-slope above `lowest` cycles a tile."""
    f = np.fft.fftfreq(size) * size
    frequency = np.hypot(f[:, None], f[None, :])
    amplitude = np.where(frequency >= lowest, np.maximum(frequency, 1) ** -slope, 0)
    noise = np.fft.ifft2(np.fft.fft2(rng.standard_normal((size, size))) * amplitude).real
    return np.asarray((noise - noise.mean()) / noise.std())


def _grain(rng: np.random.Generator, *, size: int) -> Image:
    """Plaster or concrete: patches with a fine grain on them."""
    patches, fine = _coloured_noise(rng, size, 1.2, 2), _coloured_noise(rng, size, 0.4, 8)
    return np.clip(128 + 27 * patches + 22 * fine, 0, 255)


def _bricks(rng: np.random.Generator, *, size: int, rows: int, columns: int) -> Image:
    """Courses of bricks of different tones in light mortar, every second one shifted by half."""
    mortar = 4
    course, column = np.divmod(np.arange(size), size // rows), size // columns
    shift = np.where(course[0] % 2 == 1, column // 2, 0)
    across = (np.arange(size)[None, :] - shift[:, None]) % size
    tones = rng.uniform(60, 140, (rows, columns))[course[0][:, None], across // column]
    joint = (course[1][:, None] < mortar) | (across % column < mortar)
    image = np.where(joint, 190.0, tones) + 14 * _coloured_noise(rng, size, 0.6, 4)
    return np.clip(image, 0, 255)


def _stones(rng: np.random.Generator, *, size: int, cells: int) -> Image:
    """Stones of different tones with dark gaps: cellular noise (Worley, SIGGRAPH 1996)."""
    seeds = rng.random((cells, cells, 2))
    tones = rng.uniform(60, 230, cells * cells)
    owner, to_gap = np.empty((size, size), dtype=np.int64), np.empty((size, size))
    _nearest_seeds(seeds, owner, to_gap)
    gap = np.clip(to_gap * (size / cells) / 4, 0, 1)  # four texels wide
    image = tones[owner] * (0.25 + 0.75 * gap) + 8 * rng.standard_normal((size, size))
    return np.clip(image, 0, 255)


@kernel
def _nearest_seeds(seeds: Any, owner: Any, to_gap: Any) -> None:
    """For every texel, the nearest of the seeds, which lie one in each cell of a periodic grid,
    and how much nearer it is than the second, in cells."""
    cells, size = seeds.shape[0], owner.shape[0]
    for row in range(size):
        y = (row + 0.5) * cells / size
        for column in range(size):
            x = (column + 0.5) * cells / size
            nearest, second = np.inf, np.inf
            for r in range(int(y) - 1, int(y) + 2):
                for c in range(int(x) - 1, int(x) + 2):
                    rr, cc = r % cells, c % cells
                    dx, dy = c + seeds[rr, cc, 0] - x, r + seeds[rr, cc, 1] - y
                    distance = np.sqrt(dx * dx + dy * dy)
                    if distance < nearest:
                        nearest, second = distance, nearest
                        owner[row, column] = rr * cells + cc
                    elif distance < second:
                        second = distance
            to_gap[row, column] = second - nearest
