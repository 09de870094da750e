"""Smooth random fields on a grid: hills, puddles and patches."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.fft import next_fast_len

from grouser.geometry import Array


def smooth_noise(
    rng: np.random.Generator,
    shape: Sequence[int],
    cell: float,
    *,
    shortest: float,
    longest: float,
) -> Array:
    """(rows, columns) Gaussian noise of mean 0 and variance 1 between two wavelengths, m.

    Its amplitude is proportional to the wavelength, so that hills of all sizes are equally steep.
    """
    padded = [next_fast_len(n + round(longest / cell), real=True) for n in shape]
    f_y, f_x = np.fft.fftfreq(padded[0], cell), np.fft.rfftfreq(padded[1], cell)
    frequency = np.hypot(f_y[:, None], f_x)
    band = (frequency >= 1 / longest) & (frequency <= 1 / shortest)
    amplitude = np.where(band, 1 / np.where(band, frequency, 1.0), 0.0)
    spectrum = np.fft.rfft2(rng.standard_normal(padded)) * amplitude
    noise = np.fft.irfft2(spectrum, s=padded)[: shape[0], : shape[1]]
    return np.asarray((noise - noise.mean()) / noise.std())


def patches(
    rng: np.random.Generator, shape: Sequence[int], cell: float, *, share: float, size: float
) -> NDArray[np.bool_]:
    """(rows, columns) patches of about a size [m] that cover a share of all cells."""
    noise = smooth_noise(rng, shape, cell, shortest=2 * size, longest=5 * size)
    return np.asarray(noise > np.quantile(noise, 1 - share)) if share > 0 else noise > np.inf
