"""256-bit binary descriptors of corners (BRIEF), compared by Hamming distance.

BRIEF (Calonder et al. 2010) compares 256 pairs of smoothed pixels around a corner. It is not made
invariant to rotation: a ground robot's camera does not roll by more than it stands.
"""

import cv2
import numpy as np
from numba import njit
from numpy.typing import NDArray

from grouser.estimators.visual.motion import COMPILED

Image = NDArray[np.uint8]
Descriptors = NDArray[np.uint64]

PATCH_RADIUS = 13
"""Pixels around a corner that its descriptor reads."""
BITS = 256


def _pattern() -> NDArray[np.int64]:
    """(256, 4) x, y of the two pixels of every comparison, normal about the corner."""
    rng = np.random.default_rng(2010)
    offsets = rng.normal(0.0, (2 * PATCH_RADIUS + 1) / 5, (BITS, 4))
    return np.clip(np.rint(offsets), -PATCH_RADIUS, PATCH_RADIUS).astype(np.int64)


_PATTERN = _pattern()


def smooth(image: Image, sigma: float) -> Image:
    """The image under a Gaussian of sigma [px]."""
    return np.asarray(cv2.GaussianBlur(image, (0, 0), sigma), dtype=np.uint8)


def describe(smoothed: Image, corners: NDArray[np.int32]) -> Descriptors:
    """Descriptors (n, 4) of corners at least PATCH_RADIUS from the edge of a smoothed image."""
    stride = smoothed.shape[1]
    place = corners[:, 1].astype(np.int64) * stride + corners[:, 0]
    first = _PATTERN[:, 1] * stride + _PATTERN[:, 0]
    second = _PATTERN[:, 3] * stride + _PATTERN[:, 2]
    return np.asarray(_describe(smoothed.ravel(), place, first, second))


@njit(**COMPILED)
def _describe(
    pixels: Image, place: NDArray[np.int64], first: NDArray[np.int64], second: NDArray[np.int64]
) -> Descriptors:
    out = np.zeros((place.shape[0], 4), np.uint64)
    for i in range(place.shape[0]):
        for word in range(4):
            bits = np.uint64(0)
            for k in range(64 * word, 64 * word + 64):
                darker = pixels[place[i] + first[k]] < pixels[place[i] + second[k]]
                bits = (bits << np.uint64(1)) | np.uint64(darker)
            out[i, word] = bits
    return out


@njit(**COMPILED)
def hamming(a: Descriptors, b: Descriptors) -> int:
    """Bits in which two descriptors (4,) differ."""
    total = np.uint64(0)
    for word in range(4):
        x = a[word] ^ b[word]
        x = x - ((x >> np.uint64(1)) & np.uint64(0x5555555555555555))
        x = (x & np.uint64(0x3333333333333333)) + (
            (x >> np.uint64(2)) & np.uint64(0x3333333333333333)
        )
        x = (x + (x >> np.uint64(4))) & np.uint64(0x0F0F0F0F0F0F0F0F)
        total += (x * np.uint64(0x0101010101010101)) >> np.uint64(56)
    return int(total)
