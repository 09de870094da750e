"""Whether a covariance tells the truth, by two measures of the same error.

The usual error is the difference of x, y and heading. But who does not know the heading of the
start does not know to which side of it the whole plane lies: what may be off is a turn of the plane
about the start, with everything on it, and of such errors the places make up a sickle, not an
ellipse. Then no covariance of differences is honest, but that of the plane's motion can be.
"""

from collections.abc import Sequence

import numpy as np
from scipy.stats import chi2

from grouser.estimators.evaluation.consistency import nees
from grouser.geometry import Array, compose, inverse, log


def plane_nees(truth: Array, estimate: Array, covariances: Array) -> Array:
    """NEES (N,) of the plane's motion xi that takes estimates (N, 3) to the truth (N, 3),
    exp(xi) T^ = T, with covariances (N, 3, 3) of the usual errors; NaN where `nees` has it.

    A small xi = (v_x, v_y, w) makes the usual error (v_x - w y, v_y + w x, w).
    """
    xi = log(compose(truth, inverse(estimate)))
    to_xi = np.tile(np.eye(3), (len(estimate), 1, 1))
    to_xi[:, 0, 2], to_xi[:, 1, 2] = estimate[:, 1], -estimate[:, 0]
    P = to_xi @ covariances @ to_xi.transpose(0, 2, 1)
    return nees(xi, np.zeros_like(xi), P)


def bounds(dof: float, runs: int, confidence: float = 0.95) -> tuple[float, float]:
    """Interval that holds the sum of squares of `dof` degrees of freedom, per run."""
    tails = np.array([(1 - confidence) / 2, (1 + confidence) / 2])
    low, high = chi2.ppf(tails, dof) / runs
    return float(low), float(high)


def leaves_at(amounts: Sequence[float], values: Sequence[float], low: float, high: float) -> float:
    """The amount at which values leave an interval: the first beyond which they are outside,
    linearly between the last inside and it; NaN where they stay."""
    first = next((k for k, value in enumerate(values) if not low <= value <= high), None)
    if first is None:
        return float("nan")
    if first == 0:
        return amounts[0]
    limit = high if values[first] > high else low
    a, b = values[first - 1], values[first]
    before, there = amounts[first - 1], amounts[first]
    return before + (there - before) * (limit - a) / (b - a)
