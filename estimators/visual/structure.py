"""What matched points alone say of a disparity offset: they must move as a rigid world does.

A constant offset of all disparities bends the space that is seen: no rigid motion maps it onto
itself. Of points w = (u, v, d) that move by the chord c, the image grows by c d / (f B) around each
point's vanishing direction; disparities that are off by o let even points at infinity grow, by
c o / (f B). Motion and offset are therefore estimated together, from the same two frames, and
neither tracks nor a known distance is needed (SPEC 1.6 with a seventh unknown). An eighth is the
bow of a pair that differs by more than its calibration says (`bow`): unsought, an offset feigns it.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from grouser.estimators.visual.bow import NO_BOW, Bow, Bowed
from grouser.estimators.visual.gauss_newton import CAUCHY, GATE, LEAST_SCALE, MEDIAN_ERROR
from grouser.estimators.visual.motion import camera_motion, measure
from grouser.estimators.visual.prior import MotionPrior
from grouser.estimators.visual.refine import CURVATURE
from grouser.geometry import Array
from grouser.kernels import kernel, kernel_using

_ROUNDS = 4  # the first finds the corrected points; an offset of 1.5 px takes three more


@dataclass(frozen=True, slots=True)
class OffsetEvidence:
    """What two frames say of the disparity offset."""

    offset: float
    """Measured minus true disparity, beyond what is subtracted already, px."""
    sigma: float
    """px, by how far the single points disagree; errors that neighbours share come on top"""
    bow: Bow | None = None
    """What these points alone say of the bow; None where they tell nothing, or none is sought."""


def offset_of_structure(
    reference: Array,
    current: Array,
    *,
    motion: Array,
    inliers: NDArray[np.bool_],
    prior: MotionPrior,
    noise: Array,
    T_base_camera: Array,
    camera: Array,
    bowed: Bowed | None = None,
) -> OffsetEvidence | None:
    """The offset of all disparities with which matched points fit a rigid motion best.

    Args:
        reference, current: (n, 3) u, v, d [px] of the same points in the two frames.
        motion: (6,) as refined without an offset; inliers: (n,) the points that agree with it.
        prior: of the motion; noise: (n, 6) variances of u, v, d in both frames [px^2].
        T_base_camera: (4, 4) mount; camera: (5,) from `intrinsics`.
        bowed: how the disparities hang on the bow; left out, there is none.

    Returns: None where the points tell nothing: the robot stands or turns on the spot.
    """
    bowed = bowed or Bowed(np.zeros(len(reference)), np.zeros(len(reference)), NO_BOW)
    held = np.concatenate([prior.sigma, [np.inf, max(bowed.bow.sigma, _SURELY)]]) ** -2.0
    try:
        offset, variance, bow, variance_of_bow = _offset_and_motion(
            reference[inliers],
            current[inliers],
            np.column_stack([bowed.reference, bowed.current])[inliers],
            motion,
            prior.mean,
            held,
            noise[inliers],
            T_base_camera,
            camera,
            _ROUNDS,
        )
    except np.linalg.LinAlgError:  # exactly at rest an offset changes nothing that is seen
        return None
    if not (np.isfinite(offset) and np.isfinite(variance) and 0 < variance < _NOTHING**2):
        return None
    beside = _without_prior(bow, variance_of_bow, bowed.bow)
    return OffsetEvidence(float(offset), float(np.sqrt(variance)), beside)


def _without_prior(change: float, variance: float, prior: Bow) -> Bow | None:
    """The bow that points alone tell, where with the prior they change it by so much."""
    if not 0 < variance < _TELLING * prior.sigma**2:
        return None
    share = 1 - variance / prior.sigma**2
    return Bow(prior.px + change / share, float(np.sqrt(variance / share)))


# px of sigma: no evidence. Where points hardly move (frame to frame), the offset that noise feigns
# makes them look nearer, and so surer: what would pass a wider gate is wrong by four pixels.
_NOTHING = 0.5
_SURELY = 1e-6  # px: the bow is known
_TELLING = 0.9  # of the prior's variance, and less: the points have something to say


@kernel
def _inverse_of_spread(Jw: Array, noise: Array) -> Array:
    """(3, 3) (Jw diag(noise[:3]) Jw^T + diag(noise[3:]))^-1."""
    S = Jw * noise[:3] @ Jw.T
    for a in range(3):
        S[a, a] += noise[3 + a]
    return np.asarray(np.linalg.inv(S))


@kernel_using(camera_motion, measure)
def _compare(
    reference: Array,
    current: Array,
    by_bow: Array,
    corrected: Array,
    unknowns: Array,
    noise: Array,
    T_base_camera: Array,
    camera: Array,
    errors: Array,
    residual: Array,
    by_point: Array,
    by_unknowns: Array,
    information: Array,
) -> None:
    """Residuals of all points, their squared errors, Jacobians and information."""
    A, b, dA, db = camera_motion(unknowns[:6].copy(), T_base_camera)
    p, Jm, axis = np.empty(3), np.empty((3, 6)), np.array([0.0, 0.0, 1.0])
    for i in range(reference.shape[0]):
        Jw = by_point[i]
        if not measure(corrected[i], A, b, dA, db, camera, p, Jw, Jm):
            errors[i] = np.inf
            continue
        # The corrected point is free of offset and bow; both measurements of it are not.
        before = (unknowns[6] + by_bow[i, 0] * unknowns[7]) * axis
        now = (unknowns[6] + by_bow[i, 1] * unknowns[7]) * axis
        residual[i] = current[i] - now - p - Jw @ (reference[i] - before - corrected[i])
        by_unknowns[i, :, :6] = Jm
        by_unknowns[i, :, 6] = axis - Jw[:, 2]
        by_unknowns[i, :, 7] = by_bow[i, 1] * axis - by_bow[i, 0] * Jw[:, 2]
        information[i] = _inverse_of_spread(Jw, noise[i])
        errors[i] = residual[i] @ (information[i] @ residual[i])


@kernel_using(_compare)
def _offset_and_motion(
    reference: Array,
    current: Array,
    by_bow: Array,
    start: Array,
    prior_mean: Array,
    held: Array,
    noise: Array,
    T_base_camera: Array,
    camera: Array,
    rounds: int,
) -> tuple[float, float, float, float]:
    """Gauss-Newton on (motion, offset, bow): the last two, each with its variance by the points'
    own spread. held: (8,) information of the priors; by_bow: (n, 2) of d, before and now."""
    n = reference.shape[0]
    unknowns, corrected = np.zeros(8), reference.copy()
    unknowns[:6] = start
    residual, errors, pull = np.zeros((n, 3)), np.zeros(n), np.zeros((n, 8))
    J, by_point, information = np.zeros((n, 3, 8)), np.zeros((n, 3, 3)), np.zeros((n, 3, 3))
    mean, variances, before = np.zeros(8), np.full(2, np.inf), np.inf
    mean[:6] = prior_mean
    for step in range(rounds):
        _compare(
            reference, current, by_bow, corrected, unknowns, noise, T_base_camera, camera,
            errors, residual, by_point, J, information,
        )  # fmt: skip
        scale = max(LEAST_SCALE, np.median(errors) / MEDIAN_ERROR)
        H = np.diag(held)
        g = held * (mean - unknowns)
        pull[:] = 0.0
        for i in range(n):
            if errors[i] < GATE * scale:
                weighted = information[i] @ J[i] / (1.0 + errors[i] / (CAUCHY * scale))
                H += J[i].T @ weighted
                pull[i] = weighted.T @ residual[i]
                g += pull[i]
        inverse = np.linalg.inv(H)
        # The first round only finds the corrected points of the motion that came in.
        change = inverse @ g if step > 0 else np.zeros(8)
        unknowns += change
        for i in range(n):
            if errors[i] < GATE * scale:
                gain = (noise[i, :3] * by_point[i]).T @ information[i]
                corrected[i] = reference[i] + gain @ (residual[i] - J[i] @ change)
                corrected[i, 2] -= unknowns[6] + by_bow[i, 0] * unknowns[7]
        bread = np.linalg.inv(CURVATURE * H + np.diag((1 - CURVATURE) * held))
        for k in range(2):
            row = bread[6 + k].copy()
            variances[k] = ((pull @ row) ** 2).sum() + (row**2 * held).sum()
        if step == 0:
            before = min(scale, 1.0) * inverse[6, 6]
    # Where they hardly move, the offset that mistaken points feign makes them look nearer, and so
    # surer of it: they are no surer than they were without.
    return unknowns[6], max(variances[0], before), unknowns[7], variances[1]
