"""What a lens and its rectification do to a picture: distortion, defocus, vignetting, glare."""

from functools import lru_cache
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from grouser.geometry import Array
from grouser.rig import StereoCamera

Picture = NDArray[np.float32]
Image = NDArray[np.uint8]

_NEWTON_STEPS = 30
_LOBES = 4
_GLARE_ANGLE = np.radians(20)
"""Around the sun within which its veil falls to 1 / e."""


class Lens:
    """The lens before one eye, and the calibration that takes its distortion out again."""

    def __init__(self, camera: StereoCamera) -> None:
        self._size = (camera.height, camera.width)
        self._focal_lengths = np.array([camera.fx, camera.fy])
        self._principal_point = np.array([camera.cx, camera.cy])
        y, x = np.indices(self._size, dtype=np.float64)
        pixels = np.stack([x, y], axis=-1)
        self._flat = ((pixels - self._principal_point) / self._focal_lengths).reshape(-1, 2)
        middle = np.array([camera.width - 1, camera.height - 1]) / 2
        off = (pixels - middle) / np.linalg.norm(middle)
        self._from_middle = np.sum(off**2, axis=-1, keepdims=True)
        flat = self._flat.reshape(*self._size, 2)
        self._rays = np.concatenate([flat, np.ones((*self._size, 1))], axis=-1)
        self._rays /= np.linalg.norm(self._rays, axis=-1, keepdims=True)
        self._raw_map = lru_cache(maxsize=4)(self._make_raw_map)
        self._rectifying_map = lru_cache(maxsize=4)(self._make_rectifying_map)

    def distorted(self, picture: Picture, k1: float) -> Picture:
        """As it falls on the sensor: an ideal picture, bent by r' = r (1 + k1 r^2)."""
        return picture if k1 == 0 else _remapped(picture, self._raw_map(k1))

    def rectified(self, image: Image, k1: float) -> Image:
        """As the calibration straightens it; black where the sensor saw nothing."""
        return image if k1 == 0 else _remapped(image, self._rectifying_map(k1))

    def vignette(self, loss: float) -> Picture:
        """(height, width, 1) share of the light that arrives: 1 in the middle, 1 - loss in the
        corners, falling with the square of the distance from the middle."""
        return np.asarray(1 - loss * self._from_middle, dtype=np.float32)

    def glare(self, amount: float, sun: Array) -> Picture:
        """(height, width, 1) share of each pixel that the sun's veil covers.

        Args:
            sun: (3,) unit vector towards it, optical frame.
        """
        angle = np.arccos(np.clip(self._rays @ sun, -1.0, 1.0))
        veil = amount * np.exp(-((angle / _GLARE_ANGLE) ** 2))
        return np.asarray(veil[..., None], dtype=np.float32)

    def _make_raw_map(self, k1: float) -> Picture:
        """(height, width, 2) where in the ideal picture each pixel of the sensor looks."""
        return self._places(_undistorted(self._flat, k1))

    def _make_rectifying_map(self, k1: float) -> Picture:
        """(height, width, 2) where on the sensor each pixel of the rectified image is found."""
        return self._places(self._flat * (1 + k1 * _square(self._flat)))

    def _places(self, flat: Array) -> Picture:
        """(height, width, 2) px of points (height * width, 2) at unit depth."""
        places = flat * self._focal_lengths + self._principal_point
        return np.asarray(places.reshape(*self._size, 2), dtype=np.float32)


def defocused(picture: Picture, sigma: float) -> Picture:
    """The picture through a Gaussian blur with a standard deviation [px]."""
    if sigma == 0:
        return picture
    blurred = cv2.GaussianBlur(picture, (0, 0), sigma, borderType=cv2.BORDER_REPLICATE)
    return np.asarray(blurred, dtype=np.float32).reshape(picture.shape)


def displaced(picture: Picture | Image, columns: float) -> Picture:
    """The picture moved to the right by columns [px], sharp at fractions of a pixel too.

    Lanczos's kernel of 4 lobes; OpenCV's own is rounded to 1/32 px.
    """
    reach = int(np.ceil(abs(columns))) + _LOBES
    off = np.arange(-reach, reach + 1) + columns
    weights = np.where(np.abs(off) < _LOBES, np.sinc(off) * np.sinc(off / _LOBES), 0.0)
    weights /= weights.sum()
    moved = cv2.sepFilter2D(
        picture.astype(np.float32), -1, weights, np.ones(1), borderType=cv2.BORDER_REPLICATE
    )
    return np.asarray(moved, dtype=np.float32).reshape(picture.shape)


def _undistorted(bent: Array, k1: float) -> Array:
    """(n, 2) the points r of r' = r (1 + k1 r^2), by Newton's method; far outside of any image
    where there are none, beyond the fold of a barrel."""
    reached = np.sqrt(_square(bent))
    r = np.minimum(reached, 0.99 / np.sqrt(-3 * k1)) if k1 < 0 else reached
    for _ in range(_NEWTON_STEPS):
        r = r - (r * (1 + k1 * r**2) - reached) / (1 + 3 * k1 * r**2)
    found = np.abs(r * (1 + k1 * r**2) - reached) < 1e-6
    scale = np.where(reached > 0, r / np.where(reached > 0, reached, 1.0), 1.0)
    return np.where(found & (1 + 3 * k1 * r**2 > 0), bent * scale, 1e3)


def _square(points: Array) -> Array:
    """(n, 1) of their distance from the optical axis."""
    return np.asarray(np.sum(points**2, axis=1, keepdims=True))


def _remapped(picture: NDArray[Any], where: Picture) -> NDArray[Any]:
    bent = cv2.remap(picture, where, None, cv2.INTER_LINEAR, borderMode=cv2.BORDER_CONSTANT)
    return np.asarray(bent).reshape(picture.shape)
