"""Read noise of a camera, drawn by inversion of its distribution over whole grey levels."""

from functools import lru_cache

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr


def add_read_noise(
    image: NDArray[np.uint8], sigma: float, rng: np.random.Generator
) -> NDArray[np.uint8]:
    """An image (height, width, channels) with Gaussian noise, clipped to 0..255.

    Gaussian noise on an image of whole grey levels, rounded to whole grey levels, takes few
    values; a table of 2^16 entries holds them in their proportions, and one random 16-bit number
    a pixel picks one. This costs a tenth of drawing normal numbers.

    Args:
        sigma: standard deviation, grey levels.
    """
    if sigma == 0:
        return image
    words = rng.integers(0, 1 << 64, -(-image.size // 4), dtype=np.uint64)  # four numbers a word
    drawn = words.view(np.uint16)[: image.size]
    noise = np.take(_inverse_distribution(sigma), drawn).reshape(image.shape)
    noisy = cv2.add(image, noise, dtype=cv2.CV_8U)  # saturates
    return np.asarray(noisy, dtype=np.uint8).reshape(image.shape)


@lru_cache(maxsize=8)
def _inverse_distribution(sigma: float) -> NDArray[np.int16]:
    """(65536,) grey levels in the proportions of a rounded normal distribution."""
    reach = int(np.ceil(6 * sigma)) + 1
    levels = np.arange(-reach, reach + 1)
    cumulative = ndtr((levels[:-1] + 0.5) / sigma)
    quantiles = (np.arange(1 << 16) + 0.5) / (1 << 16)
    return levels[np.searchsorted(cumulative, quantiles)].astype(np.int16)
