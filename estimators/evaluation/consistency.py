"""Whether an estimator's covariance tells the truth about its error."""

import numpy as np
from scipy.stats import chi2

from grouser.geometry import Array, wrap

# Smallest eigenvalue of the correlation matrix that can still be inverted with some digits left.
_SINGULAR = 1e-9


def nees(truth: Array, estimate: Array, covariances: Array) -> Array:
    """Normalised estimation error squared (N,) of poses (N, 3), with covariances (N, 3, 3).

    Its mean is 3 for an honest estimator. NaN where the covariance is singular and the figure does
    not exist: at the start, whose pose is known exactly, and for an estimator that claims none.
    Bar-Shalom, Li and Kirubarajan, "Estimation with applications to tracking", 2001, eq. (5.4.2-2).
    """
    error = np.asarray(estimate - truth, dtype=np.float64)
    error[:, 2] = wrap(error[:, 2])
    regular = np.array([_is_regular(P) for P in covariances], dtype=bool)
    values = np.full(len(error), np.nan)
    e, P = error[regular], covariances[regular]
    values[regular] = np.einsum("ni,ni->n", e, np.linalg.solve(P, e[:, :, None])[:, :, 0])
    return values


def with_reference_noise(truth: Array, covariances: Array, sigmas: Array) -> Array:
    """Covariances (N, 3, 3) of how far estimates are off reference poses (N, 3) that are noisy too,
    with independent errors of x, y [m] and heading [rad] in each of them: that of the first one
    turns and shifts them all, for estimates are in its frame.

    Args:
        covariances: (N, 3, 3) of the estimates alone.
        sigmas: (3,) of a reference pose.
    """
    R = np.diag(np.square(sigmas))
    by_first = np.tile(np.eye(3), (len(truth), 1, 1))
    by_first[:, 0, 2], by_first[:, 1, 2] = -truth[:, 1], truth[:, 0]
    total = covariances + R + by_first @ R @ by_first.transpose(0, 2, 1)
    total[0] = covariances[0]  # where both start by definition
    return np.asarray(total)


def mean_bounds(n: int, *, dof: int = 3, confidence: float = 0.95) -> tuple[float, float]:
    """Interval that holds the mean of n independent NEES of an honest estimator.

    Frames of one run are not independent: n counts runs, looked at in one and the same frame.

    Raises:
        ValueError: no run, or a confidence that is no probability.
    """
    if n < 1 or not 0 < confidence < 1:
        raise ValueError(
            f"bounds need n >= 1 runs and a confidence between 0 and 1; got {n}, {confidence}"
        )
    tails = np.array([(1 - confidence) / 2, (1 + confidence) / 2])
    low, high = chi2.ppf(tails, n * dof) / n
    return float(low), float(high)


def _is_regular(P: Array) -> bool:
    scale = np.sqrt(np.diag(P))
    if not np.all(scale > 0):
        return False
    correlation = P / np.outer(scale, scale)
    return bool(np.linalg.eigvalsh(correlation)[0] > _SINGULAR)
