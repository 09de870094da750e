"""How large a prediction's noise truly is, as a share of what it is taken for: from innovations.

The a-posteriori variance factor of geodesy, estimated as variance components are (Koch, "Parameter
Estimation and Hypothesis Testing in Linear Models", 3.6): every squared innovation counts by what
it tells of the prediction's noise beside that of the measurement, in degrees of freedom. Some of
one more stand for the prior that the factor is one, and the past is forgotten, as grounds change.
"""

from dataclasses import dataclass

import numpy as np

from grouser.geometry import Array
from grouser.kernels import kernel

_LEAST, _MOST = 0.03, 100.0
"""Beyond either, the model of the noise is wrong rather than its size; and as much may one say."""


@dataclass(frozen=True, slots=True, eq=False)
class Innovation:
    """By how much a measurement was off what was predicted, and why it may have been."""

    error: Array
    """(n,)"""
    covariance: Array
    """(n, n) of it, from all that is uncertain"""
    of_prediction: Array
    """(n, n) the part that the prediction's white noise brings, as it is assumed"""


class VarianceFactor:
    """One where the noise is as it is taken to be; 0.25 where its sigma is half of that."""

    def __init__(self, *, prior: float, memory: float) -> None:
        """
        Args:
            prior: degrees of freedom for which the factor is one.
            memory: innovations after which one counts for 1 / e of what it did.
        """
        self._prior, self._kept = prior, float(np.exp(-1 / memory))
        self._freedoms = self._sum = 0.0

    @property
    def value(self) -> float:
        """The estimate."""
        told = (self._prior + self._sum) / (self._prior + self._freedoms)
        return min(max(told, _LEAST), _MOST)

    def learn(self, seen: Innovation) -> None:
        """From an innovation that is independent of those before it."""
        told, freedoms = _evidence(seen.error, seen.covariance, seen.of_prediction)
        self._take(told, freedoms)

    def learn_one(self, squared_error: float, predicted: float, measured: float) -> None:
        """The same of one number: its squared error, and the variances that the prediction brings
        (taken once) and all else."""
        brought = self.value * predicted
        variance = brought + measured
        if brought <= 0:
            return
        share = brought / variance
        told = share * share + share * (squared_error / variance - 1)
        self._take(self.value * told, share * share)

    def _take(self, told: float, freedoms: float) -> None:
        self._sum = self._kept * self._sum + min(told, _MOST * freedoms)
        self._freedoms = self._kept * self._freedoms + freedoms


@kernel
def _evidence(error: Array, S: Array, Q: Array) -> tuple[float, float]:
    """The factor that an innovation tells over that of Q, times the degrees of freedom with which
    it tells it, and these: Fisher's scoring of a normal likelihood."""
    weighed = np.linalg.solve(S, error)
    share = np.linalg.solve(S, Q)
    freedoms = np.trace(share @ share)
    return freedoms + weighed @ Q @ weighed - np.trace(share), freedoms
