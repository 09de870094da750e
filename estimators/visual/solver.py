"""What a minimal solver of visual odometry does; front end, refinement and filter are shared."""

from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from grouser.estimators.visual.matching import Matches
from grouser.estimators.visual.prior import MotionPrior
from grouser.geometry import Array


@dataclass(frozen=True, slots=True)
class Hypothesis:
    """A motion that many matches agree on, to be refined."""

    motion: Array
    """(6,) as in `visual.motion`"""
    inliers: NDArray[np.bool_]
    """(n,) which matches agree"""
    trials: int
    """Minimal samples that were tried; where a library does not tell, the most it may have."""


class MotionSolver(ABC):
    """Finds the motion between two frames among matches of which some are wrong."""

    @abstractmethod
    def solve(
        self, matches: Matches, prior: MotionPrior, rng: np.random.Generator
    ) -> Hypothesis | None:
        """The best hypothesis, or None where no minimal sample gives a motion.

        Args:
            prior: what is believed of the motion but for its turn and chord.
            rng: the only source of chance.
        """
