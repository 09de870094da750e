"""What matched points alone say of a disparity offset: they must move as a rigid world does.

A constant offset of all disparities bends the space that is seen: no rigid motion maps it onto
itself. Of points w = (u, v, d) that move by the chord c, the image grows by c d / (f B) around each
point's vanishing direction; disparities that are off by o let even points at infinity grow, by
c o / (f B). Motion and offset are therefore estimated together, from the same two frames, and
neither tracks nor a known distance is needed (SPEC 1.6 with a seventh unknown).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

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
) -> OffsetEvidence | None:
    """The offset of all disparities with which matched points fit a rigid motion best.

    Args:
        reference, current: (n, 3) u, v, d [px] of the same points in the two frames.
        motion: (6,) as refined without an offset; inliers: (n,) the points that agree with it.
        prior: of the motion; noise: (n, 6) variances of u, v, d in both frames [px^2].
        T_base_camera: (4, 4) mount; camera: (5,) from `intrinsics`.

    Returns: None where the points tell nothing: the robot stands or turns on the spot.
    """
    try:
        offset, variance = _offset_and_motion(
            reference[inliers],
            current[inliers],
            motion,
            prior.mean,
            1.0 / prior.sigma**2,
            noise[inliers],
            T_base_camera,
            camera,
            _ROUNDS,
        )
    except np.linalg.LinAlgError:  # exactly at rest an offset changes nothing that is seen
        return None
    if not (np.isfinite(offset) and np.isfinite(variance) and 0 < variance < _NOTHING**2):
        return None
    return OffsetEvidence(float(offset), float(np.sqrt(variance)))


# px of sigma: no evidence. Where points hardly move (frame to frame), the offset that noise feigns
# makes them look nearer, and so surer: what would pass a wider gate is wrong by four pixels.
_NOTHING = 0.5


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
    offset = unknowns[6] * axis
    for i in range(reference.shape[0]):
        Jw = by_point[i]
        if not measure(corrected[i], A, b, dA, db, camera, p, Jw, Jm):
            errors[i] = np.inf
            continue
        # The corrected point is free of the offset; both measurements of it are not.
        residual[i] = current[i] - offset - p - Jw @ (reference[i] - offset - corrected[i])
        by_unknowns[i, :, :6] = Jm
        by_unknowns[i, :, 6] = axis - Jw[:, 2]
        information[i] = _inverse_of_spread(Jw, noise[i])
        errors[i] = residual[i] @ (information[i] @ residual[i])


@kernel_using(_compare)
def _offset_and_motion(
    reference: Array,
    current: Array,
    start: Array,
    prior_mean: Array,
    prior_information: Array,
    noise: Array,
    T_base_camera: Array,
    camera: Array,
    rounds: int,
) -> tuple[float, float]:
    """Gauss-Newton on (motion, offset): the offset and its variance by the points' own spread."""
    n = reference.shape[0]
    unknowns, corrected = np.append(start, 0.0), reference.copy()
    residual, errors, pull = np.zeros((n, 3)), np.zeros(n), np.zeros((n, 7))
    J, by_point, information = np.zeros((n, 3, 7)), np.zeros((n, 3, 3)), np.zeros((n, 3, 3))
    held, variance = np.append(prior_information, 0.0), np.inf
    for step in range(rounds):
        _compare(
            reference, current, corrected, unknowns, noise, T_base_camera, camera,
            errors, residual, by_point, J, information,
        )  # fmt: skip
        scale = max(LEAST_SCALE, np.median(errors) / MEDIAN_ERROR)
        H = np.diag(held)
        g = np.append(prior_information * (prior_mean - unknowns[:6]), 0.0)
        pull[:] = 0.0
        for i in range(n):
            if errors[i] < GATE * scale:
                weighted = information[i] @ J[i] / (1.0 + errors[i] / (CAUCHY * scale))
                H += J[i].T @ weighted
                pull[i] = weighted.T @ residual[i]
                g += pull[i]
        inverse = np.linalg.inv(H)
        # The first round only finds the corrected points of the motion that came in.
        change = inverse @ g if step > 0 else np.zeros(7)
        unknowns += change
        for i in range(n):
            if errors[i] < GATE * scale:
                gain = (noise[i, :3] * by_point[i]).T @ information[i]
                corrected[i] = reference[i] + gain @ (residual[i] - J[i] @ change)
                corrected[i, 2] -= unknowns[6]
        bread = np.linalg.inv(CURVATURE * H + np.diag((1 - CURVATURE) * held))
        of_offset = bread[6].copy()
        variance = ((pull @ of_offset) ** 2).sum() + (of_offset**2 * held).sum()
    return unknowns[6], variance
