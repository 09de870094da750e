"""Errors-in-variables refinement of a chassis motion on matched points (SPEC 1.5 step 4, 1.6).

Both frames' measurements are noisy. A plain reprojection error evaluated at the noisy reference
point is biased at sub-pixel motion, so every point carries a corrected position that is estimated
with the motion. Planarity and the non-holonomic constraint enter as priors with a sigma.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from grouser.estimators.visual.gauss_newton import CAUCHY, GATE, gauss_newton
from grouser.estimators.visual.prior import MotionPrior
from grouser.geometry import Array
from grouser.kernels import kernel


@dataclass(frozen=True, slots=True)
class Refinement:
    """A refined motion and what supports it."""

    motion: Array
    """(6,) as in `visual.motion`."""
    covariance: Array
    """(6, 6) of independent pixel noise, as large as the residuals show it to be"""
    by_disparity: Array
    """(6,) error of the motion per px by which all disparities are off: it does not average out"""
    inliers: NDArray[np.bool_]
    """(n,)"""
    noise_ratio: float
    """Robust squared error of the inliers over what the assumed pixel noise makes expected."""
    iterations: int


def refine(
    reference: Array,
    current: Array,
    *,
    start: Array,
    supporters: NDArray[np.bool_],
    prior: MotionPrior,
    noise: Array,
    T_base_camera: Array,
    camera: Array,
    shares: Array | None = None,
    iterations: int = 20,
) -> Refinement:
    """The motion that best explains matched points.

    Args:
        reference, current: (n, 3) u, v, d [px] of the same points in the two frames.
        start: (6,) first guess, good to a few pixels.
        supporters: (n,) points believed to be right; their errors tell how noisy pixels are.
        prior: of the motion; its sigmas are finite, if wide.
        noise: (n, 6) variances of u, v, d in the reference and in the current frame [px^2].
        T_base_camera: (4, 4) mount; camera: (5,) from `intrinsics`.
        shares: (n,) how much of a witness each point is; those that err alike are one together.
            Left out, all are independent.
    """
    information = 1.0 / prior.sigma**2
    motion, points, by_disparity, errors, scale, steps = gauss_newton(
        np.ascontiguousarray(reference),
        np.ascontiguousarray(current),
        start,
        supporters,
        prior.mean,
        information,
        noise,
        np.ones(len(reference)) if shares is None else shares,
        T_base_camera,
        camera,
        iterations,
    )
    covariance, inliers, ratio = _stated(points, information, errors, GATE * scale, CAUCHY * scale)
    return Refinement(motion, covariance, by_disparity, inliers, ratio, steps)


def _expectations() -> tuple[float, float, float]:
    """What Cauchy weights on gated chi-square errors make of the points' weighted information.

    Returns: the weighted mean error; the curvature of the cost and the spread of its gradient, both
    over the weighted information. Integrals are over the chi-square density of 3 degrees.
    """
    e = np.linspace(0, GATE, 20001)[1:]
    density = np.sqrt(e) * np.exp(-e / 2)
    density /= density.sum()
    w = 1.0 / (1.0 + e / CAUCHY)
    # psi(r) = w(|r|^2) r in 3-D: mean of dpsi/dr is E[w + (2/3) e w'(e)], of psi psi^T E[w^2 e]/3
    slope = np.sum(density * (w - 2 / 3 * e * w**2 / CAUCHY))
    spread = np.sum(density * w**2 * e) / 3
    mean_weight = np.sum(density * w)
    mean_error = np.sum(density * w * e) / mean_weight
    return float(mean_error), float(slope / mean_weight), float(spread / mean_weight)


# Of the assumed pixel variances: residuals cannot show the errors that all points share.
_LEAST_NOISE = 0.25

_EXPECTED_ERROR, CURVATURE, _SPREAD = _expectations()


@kernel
def _stated(
    points: Array, prior: Array, errors: Array, gate: float, cauchy: float
) -> tuple[Array, NDArray[np.bool_], float]:
    """Covariance (6, 6) of the weighted estimate, its inliers (n,), and their noise ratio.

    points: (6, 6) information of the weighted points; prior: (6,) that of the prior; gate, cauchy:
    squared errors at which a point is no inlier, and at which its weight has halved.

    The points' part is weighted by the errors themselves, and as noisy as they turned out to be;
    the prior's is not, and what only the prior holds must keep the prior's variance.
    """
    inverse = np.linalg.inv(points + np.diag(prior))
    inliers = errors < gate
    # How many numbers the points determined, which their residuals are smaller by.
    fitted = 6 - (np.diag(inverse) * prior).sum()
    ratio = _noise_ratio(errors[inliers], cauchy, fitted)
    bread = np.linalg.inv(CURVATURE * points + np.diag(prior))
    spread = max(ratio, _LEAST_NOISE) * _SPREAD * points + np.diag(prior)
    return bread @ spread @ bread, inliers, ratio


@kernel
def _noise_ratio(errors: Array, cauchy: float, fitted: float) -> float:
    """Weighted mean of the inliers' squared errors (n,), over the expected one."""
    freedom = 3 * len(errors) - fitted
    if freedom <= 0:
        return np.inf
    weights = 1.0 / (1.0 + errors / cauchy)
    mean = (weights * errors).sum() / weights.sum()
    return float(mean / _EXPECTED_ERROR * 3 * len(errors) / freedom)
