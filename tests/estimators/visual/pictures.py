"""Pictures of a texture that is known in closed form, so that any sub-pixel warp of it is exact."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from grouser.estimators.visual.descriptor import Image, smooth
from grouser.geometry import Array

Texture = Callable[[Array, Array], Array]
"""Grey values at places x, y [px]."""

WIDTH, HEIGHT = 160, 120


def waves(
    rng: np.random.Generator,
    *,
    shortest: float = 8.0,
    longest: float = 40.0,
    contrast: float = 28.0,
) -> Texture:
    """A sum of plane waves of random direction; their lengths are in px."""
    n = 30
    length = np.exp(rng.uniform(np.log(shortest), np.log(longest), n))
    direction, phase = rng.uniform(0, 2 * np.pi, (2, n))
    kx, ky = 2 * np.pi / length * np.cos(direction), 2 * np.pi / length * np.sin(direction)

    def grey(x: Array, y: Array) -> Array:
        angles = kx * x[..., None] + ky * y[..., None] + phase
        return np.asarray(128 + contrast * np.sqrt(2 / n) * np.cos(angles).sum(axis=-1))

    return grey


def stripes(x: Array, y: Array) -> Array:
    """Vertical stripes: nothing in them says where they are along y."""
    return 128 + 80 * np.sin(2 * np.pi * x / 12) + 0 * y


def painted(texture: Texture, warp: Callable[[Array, Array], tuple[Array, Array]]) -> Image:
    """The image whose pixel (x, y) shows the texture at warp(x, y)."""
    x, y = np.meshgrid(np.arange(WIDTH, dtype=np.float64), np.arange(HEIGHT, dtype=np.float64))
    return np.asarray(np.clip(np.rint(texture(*warp(x, y))), 0, 255), dtype=np.uint8)


def plain(texture: Texture) -> Image:
    return painted(texture, lambda x, y: (x, y))


def blocks(rng: np.random.Generator, *, width: int = 320, height: int = 240) -> Image:
    """Overlapping rectangles in greys, small and large: full of corners."""
    image = np.full((height, width), 128, dtype=np.uint8)
    for _ in range(width * height // 30):
        x, y = rng.integers(-10, width), rng.integers(-10, height)
        w, h = rng.integers(3, 16, 2)
        image[max(y, 0) : max(y + h, 0), max(x, 0) : max(x + w, 0)] = rng.integers(30, 220)
    return smooth(image, 0.8)


class Scene:
    """Sharp blocks on a wall, each pixel the mean of the light on it, as in a camera.

    Resampled pictures would not do: interpolation kernels displace detail by hundredths of a pixel.
    """

    FINENESS = 8
    """Light is known at so many places a pixel: shifts may be multiples of an eighth."""

    def __init__(self, rng: np.random.Generator, *, margin: int = 50) -> None:
        self._margin, k = margin, self.FINENESS
        width, height = 320 + 2 * margin, 240 + 2 * margin
        self._light = np.full((k * height, k * width), 128, dtype=np.uint8)
        for _ in range(width * height // 30):
            x, y = rng.integers(-10 * k, width * k), rng.integers(-10 * k, height * k)
            w, h = rng.integers(3 * k, 16 * k, 2)
            rows, columns = slice(max(y, 0), max(y + h, 0)), slice(max(x, 0), max(x + w, 0))
            self._light[rows, columns] = rng.integers(30, 220)

    def view(self, dx: float, dy: float) -> Image:
        """(240, 320) with everything seen dx, dy [px] further right and down."""
        k = self.FINENESS
        left, top = (round(k * (self._margin - shift)) for shift in (dx, dy))
        light = self._light[top : top + 240 * k, left : left + 320 * k]
        seen = np.rint(light.reshape(240, k, 320, k).mean(axis=(1, 3)))
        return np.asarray(seen, dtype=np.uint8)


def grid(step: int = 20, margin: int = 30) -> NDArray[np.float64]:
    """(n, 2) places over the picture, away from its edges."""
    x, y = np.meshgrid(
        np.arange(margin, WIDTH - margin, step), np.arange(margin, HEIGHT - margin, step)
    )
    return np.stack([x.ravel(), y.ravel()], axis=-1).astype(np.float64)
