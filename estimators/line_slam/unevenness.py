"""How far real walls are off the lines that they are taken for, learnt from how well they fit.

A line's covariance from a scan says what the lidar's noise does. A wall has skirting boards, door
frames and bulges, and is seen in other parts each time: as if either end of what is seen of it were
off by so much, across. Short parts then tell little of a wall's direction, long ones much.
"""

from dataclasses import replace

import numpy as np

from grouser.estimators.line_slam.lines import places_along
from grouser.estimators.line_slam.measurements import LineMeasurements
from grouser.geometry import Array


class Unevenness:
    """Of the walls around: its likeliest value, of a few, given how well lines fitted lately."""

    def __init__(self, known: float | None = None, *, least: float = 0.0) -> None:
        """
        Args:
            known: m, one sigma; None where it is to be learnt.
            least: m; less is not learnt.
        """
        likely = _CANDIDATES[_CANDIDATES >= least]
        self._squares = likely**2 if known is None else np.array([known**2])
        self._log_weights = np.zeros(len(self._squares))
        self.variance = self._mean()
        """m^2, the mean over the candidates as likely as they are."""

    @property
    def learns(self) -> bool:
        """Whether it is not known."""
        return len(self._squares) > 1

    def _mean(self) -> float:
        weights = np.exp(self._log_weights - self._log_weights.max())
        return float(weights @ self._squares / weights.sum())

    @property
    def sigma(self) -> float:
        """m"""
        return float(np.sqrt(self.variance))

    def widened(self, seen: LineMeasurements) -> LineMeasurements:
        """What was seen, as sure as it is of walls."""
        if not len(seen) or self.variance == 0:
            return seen
        variance = _LOOKS_ALIKE * self.variance
        return replace(seen, covariances=seen.covariances + variance * of_uneven(seen))

    def learn(self, residuals: Array, S: Array, of_one: Array) -> None:
        """From k lines that fitted.

        Args:
            residuals: (2k,)
            S: (2k, 2k) their covariance, if walls were even.
            of_one: (k, 2, 2) what an unevenness of 1 m adds to that of each.
        """
        k = len(of_one)
        added = np.zeros((2 * k, 2 * k))
        for i in range(k):
            added[2 * i : 2 * i + 2, 2 * i : 2 * i + 2] = of_one[i]
        each = S + self._squares[:, None, None] * added
        d2 = np.einsum("i,cij,j->c", residuals, np.linalg.inv(each), residuals)
        likelihood = -0.5 * (d2 + np.linalg.slogdet(each)[1])
        self._log_weights = _KEEPS**k * self._log_weights + likelihood - likelihood.max()
        self.variance = self._mean()


def of_uneven(seen: LineMeasurements) -> Array:
    """(n, 2, 2) covariance of r and alpha where either end seen is off by 1 m across, one sigma."""
    t = places_along(seen.lines[:, None], seen.ends)
    D = (t[:, 1] - t[:, 0])[:, None]
    j = np.stack([np.stack([t[:, 1], -t[:, 0]], -1) / D, np.array([1.0, -1.0]) / D], -1)
    return np.asarray(np.einsum("nia,nib->nab", j, j))


_CANDIDATES = np.array([0.0, 0.005, 0.01, 0.02, 0.03, 0.045])
"""m: from a line on a plane to a cluttered corridor."""
_LOOKS_ALIKE = 4.0
"""Looks in a row that show the same part of a wall, off in the same way, as one measurement."""
_KEEPS = 0.98
"""Of what earlier lines told, a line: the last fifty or so count."""
