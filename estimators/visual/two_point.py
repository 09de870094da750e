"""Two-point RANSAC: planar motion without the non-holonomic constraint (turn, chord and side).

Two points fix a rigid motion in the plane by the closed form of absolute orientation (Horn 1987,
Umeyama 1991), here of the points' plan view. Each point is weighted by its inverse range squared:
that is alignment in disparity space, where the noise of near and far points is alike. The points'
height, which a planar motion keeps, says with the disparity how their ranges changed (SPEC 1.2).
"""

import numpy as np
from numpy.typing import NDArray

from grouser.estimators.visual.agreement import squared_errors
from grouser.estimators.visual.chassis import chassis_motions
from grouser.estimators.visual.matching import Matches
from grouser.estimators.visual.motion import intrinsics
from grouser.estimators.visual.planar import PlanarSolver
from grouser.estimators.visual.prior import MotionPrior
from grouser.estimators.visual.ransac import LIMIT, ransac
from grouser.estimators.visual.solver import Hypothesis, MotionSolver
from grouser.geometry import Array, transform
from grouser.rig import R_BASE_OPTICAL, StereoCamera

_SAMPLE = 2


class TwoPointRansac(MotionSolver):
    """Turn, chord and side of a chassis that keeps to the plane but may slip sideways."""

    def __init__(self, camera: StereoCamera) -> None:
        self._camera = camera
        self._solver = PlanarSolver(camera)
        self._levelled_mount = transform(R_BASE_OPTICAL, camera.T_base_camera[:3, 3])

    def solve(
        self, matches: Matches, prior: MotionPrior, rng: np.random.Generator
    ) -> Hypothesis | None:
        view = self._plan_view(matches)
        slack = prior.sigma**2
        slack[:3] = 0.0  # what the samples tell

        def propose(samples: NDArray[np.intp]) -> Array:
            turn, shift = align_plans(*(part[samples] for part in view))
            good = np.isfinite(turn)
            return self._motions(turn[good], shift[good])

        def judge(motions: Array) -> Array:
            camera, mount = intrinsics(self._camera), self._camera.T_base_camera
            points = matches.reference, matches.current, matches.noise
            return np.asarray(squared_errors(motions, *points, slack, mount, camera) / LIMIT)

        usable = np.flatnonzero(np.isfinite(view[2]))
        found = ransac(usable, _SAMPLE, propose, judge, rng)
        return None if found is None else Hypothesis(found.model, found.inliers, found.trials)

    def _plan_view(self, matches: Matches) -> tuple[Array, Array, Array]:
        """Of each point z + jx before and after, both over its range before, and that range's
        inverse, NaN where there is none; (n,) each, up to a common factor."""
        points = self._solver.level(matches.reference, matches.current)
        q, d, q_, d_ = points.q, points.d, points.q_, points.d_
        k1, k2 = (q[:, 1] + q_[:, 1]) / 2, (d + d_) / 4
        m, m_ = k1 * q[:, 1] + k2 * d, k1 * q_[:, 1] + k2 * d_  # SPEC 1.2: range is g / m
        usable = (m > 0) & (m_ > 0) & (d + d_ > 0)
        m, m_ = np.where(usable, m, np.nan), np.where(usable, m_, np.nan)
        inverse = m * (d + d_) / (self._camera.baseline * (m + m_))
        before, after = q[:, 2] + 1j * q[:, 0], q_[:, 2] + 1j * q_[:, 0]
        return before, after * (m / m_), inverse

    def _motions(self, turn: Array, shift: Array) -> Array:
        c, s, zero = np.cos(turn), np.sin(turn), np.zeros_like(turn)
        # eq. (15): P' = R P + T
        R = np.stack([c, zero, s, zero, zero + 1, zero, -s, zero, c], axis=-1).reshape(-1, 3, 3)
        T = np.stack([shift.imag, zero, shift.real], axis=-1)
        return chassis_motions(R, T, self._levelled_mount)


def align_plans(before: Array, after: Array, inverse: Array) -> tuple[Array, Array]:
    """Turns (k,) and shifts (k,) that take points over their ranges to where they are afterwards.

    They minimise |after - exp(j turn) before - inverse shift|^2 over the points of each row (k, m)
    of complex z + jx; NaN where all points of a row are one.
    """
    weight = (inverse**2).sum(axis=1, keepdims=True)
    centre = (inverse * before).sum(axis=1, keepdims=True) / weight
    centre_ = (inverse * after).sum(axis=1, keepdims=True) / weight
    arms, arms_ = before - inverse * centre, after - inverse * centre_
    product = (arms.conj() * arms_).sum(axis=1)
    size = (np.abs(before) * np.abs(after)).sum(axis=1)
    turn = np.where(np.abs(product) > _SAME * size, np.angle(product), np.nan)
    return turn, centre_[:, 0] - np.exp(1j * turn) * centre[:, 0]


_SAME = 1e-12
