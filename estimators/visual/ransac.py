"""RANSAC over samples of two matches or more, in batches (Fischler and Bolles 1981).

Models are scored by truncated squared errors (MSAC, Torr and Zisserman 2000), and samples are
drawn until one of right matches only is as good as certain.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from grouser.estimators.visual.gauss_newton import GATE
from grouser.geometry import Array

CONFIDENCE = 0.99
LIMIT = 4 * GATE
"""Largest squared error of an inlier: a hypothesis has the noise of its sample besides."""
BATCH = 32
"""Samples a round, and the fewest that are tried: noise spoils samples of right matches, too."""
MOST_TRIALS = 1000

Propose = Callable[[NDArray[np.intp]], Array]
"""Models (k, ...) from samples (m, size); a sample may give none, one or several."""
Judge = Callable[[Array], Array]
"""Squared errors (k, n) of all matches under models (k, ...), over the inlier limit."""


@dataclass(frozen=True, slots=True)
class Consensus:
    """The model that most matches agree with."""

    model: Array
    inliers: NDArray[np.bool_]
    """(n,)"""
    trials: int
    """Samples that were drawn."""


def trials_needed(inlier_share: float, size: int, confidence: float = CONFIDENCE) -> int:
    """Samples until one is of inliers only with this probability, at most MOST_TRIALS."""
    good = inlier_share**size
    if good >= confidence:
        return 1
    if good < -math.log1p(-confidence) / MOST_TRIALS:
        return MOST_TRIALS
    return min(MOST_TRIALS, math.ceil(math.log1p(-confidence) / math.log1p(-good)))


def ransac(
    usable: NDArray[np.intp], size: int, propose: Propose, judge: Judge, rng: np.random.Generator
) -> Consensus | None:
    """The best of sampled models; None where no sample gives one.

    Args:
        usable: (m,) matches that samples may consist of.
        size: how many matches make a sample.
    """
    if len(usable) < size:
        return None
    best: tuple[Array, Array] | None = None
    least, trials, needed = np.inf, 0, MOST_TRIALS
    while trials < needed:
        batch = min(BATCH, MOST_TRIALS - trials)
        models = propose(usable[minimal_samples(len(usable), size, batch, rng)])
        trials += batch
        if len(models) == 0:
            continue
        errors = judge(models)
        costs = np.minimum(errors, 1.0).sum(axis=1)
        first = int(np.argmin(costs))
        if costs[first] < least:
            least, best = costs[first], (models[first], errors[first])
            needed = trials_needed(float(np.mean(errors[first] < 1.0)), size)
    if best is None:
        return None
    model, errors = best
    return Consensus(model, errors < 1.0, trials)


def minimal_samples(n: int, size: int, number: int, rng: np.random.Generator) -> NDArray[np.intp]:
    """Samples (number, size) of different indices below n, all equally likely."""
    return np.argpartition(rng.random((number, n)), size - 1, axis=1)[:, :size]
