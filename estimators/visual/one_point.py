"""One-point RANSAC (paper 1 III.A.3): every hypothesis of turn and chord takes a single match."""

import math

import numpy as np
from numpy.typing import NDArray

from grouser.estimators.visual.matching import Matches
from grouser.estimators.visual.planar import PlanarSolver
from grouser.estimators.visual.prior import MotionPrior
from grouser.estimators.visual.solver import Hypothesis, MotionSolver
from grouser.estimators.visual.turn_errors import TURN_ERRORS
from grouser.geometry import Array
from grouser.kernels import kernel
from grouser.rig import StereoCamera

INLIER_SIGMAS = 3.0
_ALL = 64  # up to so many points, every one of them is tried: that costs less than choosing
_TINY = 1e-300
_OUTLIERS = 0.9  # the ratio that the number of sampled hypotheses is safe against


def hypotheses_needed(outlier_ratio: float, success: float = 0.99) -> int:
    """Samples of one point until one is good with probability `success` (SPEC 1.5, step 3)."""
    return math.ceil(math.log(1 - success) / math.log(outlier_ratio)) if outlier_ratio > 0 else 1


class OnePointRansac(MotionSolver):
    """Turn first, then chord among the points that agree on the turn (the paper's two stages)."""

    def __init__(self, camera: StereoCamera, *, turn_error: str | None = None) -> None:
        """turn_error: one of `TURN_ERRORS`, which matches must keep as well as their own sigmas."""
        self._solver = PlanarSolver(camera)
        self._turn_error = None if turn_error is None else TURN_ERRORS[turn_error]
        self._lever = float(camera.T_base_camera[0, 3]) / camera.baseline

    def solve(
        self, matches: Matches, prior: MotionPrior, rng: np.random.Generator
    ) -> Hypothesis | None:
        points = self._solver.level(matches.reference, matches.current)
        slack = prior.tolerance
        turns, turn_sigmas = self._solver.turns(points, matches.noise, slack, side=prior.side)
        turn, agree, trials = consensus(turns, turn_sigmas, rng)
        if turn is None:
            return None
        if self._turn_error is not None:
            errors, limit = self._turn_error
            agree &= errors(points, np.array([turn]), self._lever)[0] < limit
        chords, chord_sigmas = self._solver.chords(points, turn, matches.noise, slack)
        chord_sigmas = np.where(agree, chord_sigmas, np.inf)
        chord, inliers, more = consensus(chords, chord_sigmas, rng)
        if chord is None:
            return None
        motion = np.array([turn, chord, prior.side, 0.0, 0.0, 0.0])
        return Hypothesis(motion, inliers, trials + more)


def consensus(
    values: Array, sigmas: Array, rng: np.random.Generator
) -> tuple[float | None, NDArray[np.bool_], int]:
    """The value that most agree on, within their sigmas: its weighted mean, who agrees, trials.

    Each candidate is scored by its truncated squared errors. Candidates are sampled by their
    precision; None where no value has a finite sigma.
    """
    weights = _precisions(values, sigmas)
    usable = weights > 0
    if not usable.any():
        return None, usable, 0
    candidates = _candidates(weights, rng)
    best, agree = _vote(values, weights, candidates)
    return best, agree, len(candidates)


@kernel
def _precisions(values: Array, sigmas: Array) -> Array:
    """1 / sigma^2 (n,); zero where there is no value."""
    weights = np.zeros(len(values))
    for i in range(len(values)):
        if np.isfinite(values[i]) and np.isfinite(sigmas[i]):
            weights[i] = 1 / sigmas[i] ** 2
    return weights


@kernel
def _vote(
    values: Array, weights: Array, candidates: NDArray[np.int64]
) -> tuple[float, NDArray[np.bool_]]:
    """The weighted mean of those who agree with the best candidate, and who does."""
    least, best, own = np.inf, 0.0, 0.0
    for candidate in candidates:
        # A candidate's own error would blur a vote of very sure points; the mean below mends it.
        score = 0.0
        for i in range(len(values)):
            score += _truncated(values[i] - values[candidate], weights[i])
        if score < least:
            least, best = score, values[candidate]
        own = max(own, weights[candidate])
    agree = np.zeros(len(values), np.bool_)
    for _ in range(2):
        total = sum_of_weights = 0.0
        for i in range(len(values)):
            near = INLIER_SIGMAS**2 * (1 / max(weights[i], _TINY) + 1 / own)
            agree[i] = weights[i] > 0 and (values[i] - best) ** 2 < near
            if agree[i]:
                total += weights[i] * values[i]
                sum_of_weights += weights[i]
        best = total / sum_of_weights
    return best, agree


@kernel
def _truncated(error: float, weight: float) -> float:
    """Squared error in sigmas, up to that of an inlier; who has no value disagrees with all."""
    if weight == 0.0:
        return INLIER_SIGMAS**2
    return min(error * error * weight, INLIER_SIGMAS**2)


def _candidates(weights: Array, rng: np.random.Generator) -> NDArray[np.int64]:
    usable = np.flatnonzero(weights)
    if len(usable) <= _ALL:
        return usable
    number = max(16, hypotheses_needed(_OUTLIERS))
    share = weights[usable] / weights[usable].sum()
    return np.asarray(rng.choice(usable, size=number, p=share))
