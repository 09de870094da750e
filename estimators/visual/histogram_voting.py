"""Histogram voting (Scaramuzza et al. 2009, 2011): every match votes for a turn, nothing is drawn.

One point fixes a planar, non-holonomic motion, so that all hypotheses there are can be counted: the
turn is the median of the fullest bin of their histogram, and so is the chord of those who agree on
the turn. Scaramuzza's monocular form votes for the turn alone; here stereo gives the chord, and
the one-point solution is that of any mount (SPEC 1.2).
"""

import numpy as np
from numpy.typing import NDArray

from grouser.estimators.visual.matching import Matches
from grouser.estimators.visual.one_point import INLIER_SIGMAS
from grouser.estimators.visual.planar import PlanarSolver
from grouser.estimators.visual.prior import MotionPrior
from grouser.estimators.visual.solver import Hypothesis, MotionSolver
from grouser.geometry import Array
from grouser.rig import StereoCamera

_BIN_SIGMAS = 2.0  # a bin's width, in sigmas of the median vote: what one peak spreads over


class HistogramVoting(MotionSolver):
    """Turn first, then chord, each by the vote of all matches."""

    def __init__(self, camera: StereoCamera) -> None:
        self._solver = PlanarSolver(camera)

    def solve(
        self, matches: Matches, prior: MotionPrior, rng: np.random.Generator
    ) -> Hypothesis | None:
        points = self._solver.level(matches.reference, matches.current)
        slack = prior.tolerance
        turns, turn_sigmas = self._solver.turns(points, matches.noise, slack, side=prior.side)
        turn, agree, votes = elect(turns, turn_sigmas)
        if turn is None:
            return None
        chords, chord_sigmas = self._solver.chords(points, turn, matches.noise, slack)
        chord, inliers, more = elect(chords, np.where(agree, chord_sigmas, np.inf))
        if chord is None:
            return None
        motion = np.array([turn, chord, prior.side, 0.0, 0.0, 0.0])
        return Hypothesis(motion, inliers, votes + more)


def elect(values: Array, sigmas: Array) -> tuple[float | None, NDArray[np.bool_], int]:
    """The median of the fullest bin of values (n,), who agrees with it (n,), and how many voted.

    Bins begin at every vote, so that no border divides a peak. A vote counts once, however sure it
    is; one without a finite sigma does not. None where nobody votes.
    """
    voters = np.isfinite(values) & np.isfinite(sigmas)
    if not voters.any():
        return None, voters, 0
    votes = np.sort(values[voters])
    width = _BIN_SIGMAS * float(np.median(sigmas[voters]))
    ends = np.searchsorted(votes, votes + width, side="right")
    fullest = int(np.argmax(ends - np.arange(len(votes))))
    elected = float(np.median(votes[fullest : ends[fullest]]))
    limit = INLIER_SIGMAS * np.where(voters, sigmas, 0.0)
    agree = voters & (np.abs(np.where(voters, values, 0.0) - elected) <= limit)
    return elected, agree, len(votes)
