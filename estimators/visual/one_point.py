"""One-point RANSAC (paper 1 III.A.3): every hypothesis of turn and chord takes a single match."""

import math

import numpy as np
from numpy.typing import NDArray

from grouser.estimators.visual.matching import Matches
from grouser.estimators.visual.planar import PlanarSolver
from grouser.estimators.visual.prior import MotionPrior
from grouser.estimators.visual.solver import Hypothesis, MotionSolver
from grouser.geometry import Array
from grouser.rig import StereoCamera

INLIER_SIGMAS = 3.0
_ALL = 64  # up to so many points, every one of them is tried: that costs less than choosing
_OUTLIERS = 0.9  # the ratio that the number of sampled hypotheses is safe against


def hypotheses_needed(outlier_ratio: float, success: float = 0.99) -> int:
    """Samples of one point until one is good with probability `success` (SPEC 1.5, step 3)."""
    return math.ceil(math.log(1 - success) / math.log(outlier_ratio)) if outlier_ratio > 0 else 1


class OnePointRansac(MotionSolver):
    """Turn first, then chord among the points that agree on the turn (the paper's two stages)."""

    def __init__(self, camera: StereoCamera) -> None:
        self._solver = PlanarSolver(camera)

    def solve(
        self, matches: Matches, prior: MotionPrior, rng: np.random.Generator
    ) -> Hypothesis | None:
        points = self._solver.level(matches.reference, matches.current)
        slack = prior.tolerance
        turns, turn_sigmas = self._solver.turns(points, matches.noise, slack, side=prior.side)
        turn, agree, trials = consensus(turns, turn_sigmas, rng)
        if turn is None:
            return None
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
    usable = np.isfinite(values) & np.isfinite(sigmas)
    if not usable.any():
        return None, usable, 0
    weights = np.where(usable, 1 / np.where(usable, sigmas, 1.0) ** 2, 0.0)
    values = np.where(usable, values, 0.0)
    candidates = _candidates(weights, rng)
    errors = (values[None, :] - values[candidates, None]) ** 2 * weights
    errors[:, ~usable] = INLIER_SIGMAS**2
    # A candidate's own error would blur a vote of very sure points; the mean below mends it.
    best = values[candidates[np.argmin(np.minimum(errors, INLIER_SIGMAS**2).sum(axis=1))]]
    own = 1 / weights[candidates].max()
    for _ in range(2):
        agree = usable & (
            (values - best) ** 2 < INLIER_SIGMAS**2 * (1 / np.maximum(weights, 1e-300) + own)
        )
        best = float(weights[agree] @ values[agree] / weights[agree].sum())
    return best, agree, len(candidates)


def _candidates(weights: Array, rng: np.random.Generator) -> NDArray[np.int64]:
    usable = np.flatnonzero(weights)
    if len(usable) <= _ALL:
        return usable
    number = max(16, hypotheses_needed(_OUTLIERS))
    share = weights[usable] / weights[usable].sum()
    return np.asarray(rng.choice(usable, size=number, p=share))
