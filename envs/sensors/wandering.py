"""An error that wanders: a first-order Gauss-Markov process."""

import math

import numpy as np

from grouser.geometry import Array


class Wandering:
    """n independent processes of unit variance, at their full size from the start.

    x(t + dt) = a x(t) + sqrt(1 - a^2) w, with a = exp(-dt / correlation_time) and w white.
    (Maybeck, Stochastic Models, Estimation and Control, vol. 1, sec. 4.11.)
    """

    def __init__(self, n: int, *, correlation_time: float, rng: np.random.Generator) -> None:
        self._correlation_time, self._rng = correlation_time, rng
        self._value: Array = rng.standard_normal(n)

    def after(self, elapsed: float) -> Array:
        """(n,) values a time [s] after the last call."""
        kept = math.exp(-elapsed / self._correlation_time)
        new = self._rng.standard_normal(len(self._value))
        self._value = kept * self._value + math.sqrt(1 - kept * kept) * new
        return self._value
