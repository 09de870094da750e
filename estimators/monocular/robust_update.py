"""Algorithm 1 of Civera et al. from the matches on: RANSAC, update, rescue, update."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from grouser.estimators.monocular.camera import Matches, Projection, innovation, project
from grouser.estimators.monocular.kalman import update
from grouser.estimators.monocular.ransac import draw_samples, ransac
from grouser.estimators.monocular.state import MOTION, SlamState
from grouser.geometry import Array

RESCUE_GATE = 9.21
"""chi-square of 2 degrees of freedom at 99 %: a high-innovation match within it is an inlier."""


@dataclass(frozen=True, slots=True)
class Updated:
    """The state after an image, and how that came about."""

    state: SlamState
    low: NDArray[np.bool_]
    """(m,) matches that agreed with the best hypothesis"""
    rescued: NDArray[np.bool_]
    """(m,) matches that the first update made plausible"""
    trials: int
    nis: float
    """Squared change of the planar motion over its expected square: chi-square of 3"""

    @property
    def inliers(self) -> NDArray[np.bool_]:
        return self.low | self.rescued


@dataclass(frozen=True, slots=True)
class RobustUpdate:
    """The filter's update with matches of which any number may be wrong."""

    T_base_camera: Array
    intrinsics: Array
    """(5,) as `camera.inverse_depth_intrinsics` has them"""
    sample: int
    """Matches that a hypothesis takes: one (Civera et al.) or two (Xu, Li and Han)."""
    threshold_px: float
    """How far a low-innovation inlier may be from where a hypothesis expects it."""

    def __call__(
        self,
        predicted: SlamState,
        projection: Projection,
        matches: Matches,
        rng: np.random.Generator,
    ) -> Updated:
        """Update the predicted state, whose points are seen as `projection` says."""
        compared = innovation(predicted, matches, predicted, projection)
        consensus = ransac(
            predicted,
            matches,
            compared,
            samples=draw_samples(len(matches.seen), self.sample, rng),
            threshold_px=self.threshold_px,
            T_base_camera=self.T_base_camera,
            intrinsics=self.intrinsics,
        )
        low = consensus.inliers
        state = update(predicted, compared.of(low))
        rescued = np.zeros_like(low)
        rescued[~low] = self._plausible(state, matches.of(~low))
        state = self._update_again(predicted, matches.of(low | rescued), state)
        return Updated(state, low, rescued, consensus.trials, _surprise(predicted, state))

    def _plausible(self, state: SlamState, matches: Matches) -> NDArray[np.bool_]:
        """Which matches the updated state explains: algorithm 1, lines 20 to 27."""
        compared = innovation(state, matches, state, self._project(state))
        return np.asarray(compared.squared() < RESCUE_GATE)

    def _update_again(self, prior: SlamState, inliers: Matches, state: SlamState) -> SlamState:
        """The update with all inliers, linearised where the state has got to.

        Civera et al. add the rescued to the first update. A new point's depth may be off by a
        factor of three in the prediction, though: linearised there, what it says of the motion is
        off as well, and the filter comes to believe in a wrong scale.
        """
        for _ in range(_ITERATIONS):
            state = update(prior, innovation(prior, inliers, state, self._project(state)))
        return state

    def _project(self, state: SlamState) -> Projection:
        return project(state, self.T_base_camera, self.intrinsics)


_ITERATIONS = 2


def _surprise(predicted: SlamState, updated: SlamState) -> float:
    """Squared change of turn, chord and side over how much the update could change them."""
    planar = slice(MOTION.start, MOTION.start + 3)
    change = updated.motion[:3] - predicted.motion[:3]
    before = predicted.covariance[planar, planar]
    # What the update did not determine could not surprise; the small term keeps it regular.
    expected = before - updated.covariance[planar, planar] + 1e-6 * np.diag(np.diag(before))
    return float(change @ np.linalg.solve(expected, change))
