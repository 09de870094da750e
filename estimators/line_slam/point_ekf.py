"""The rival of paper 2's filter: landmarks are points, seen by range and bearing."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from grouser.checks import require_positive
from grouser.estimators.base import Observation
from grouser.estimators.line_slam.motion import MotionModel
from grouser.estimators.line_slam.point_sight import PointSight
from grouser.estimators.line_slam.points import PointMap, polar, polar_jacobians, seen_at
from grouser.estimators.line_slam.predict import predict
from grouser.estimators.line_slam.sparse_update import absorb, correct
from grouser.estimators.line_slam.state import POSE, LineState
from grouser.geometry import Array, wrap


@dataclass(frozen=True, slots=True)
class PointEkfOptions:
    """Which point of the map was seen, and by which Jacobian it corrects."""

    gate: float = 9.21
    """d2, of two degrees of freedom, up to which two points are one: chi2(.99)."""
    new_above: float = 25.0
    """d2 to the nearest above which a point is new; what lies in between is left out."""
    printed: bool = False
    """Whether eq. (11) is taken as printed, with two wrong entries."""

    def __post_init__(self) -> None:
        require_positive(self, "gate", "new_above")


@dataclass(frozen=True, slots=True)
class PointsTold:
    """What a step of the filter saw."""

    seen: int = 0
    matched: int = 0
    """Of them, points of the map, that corrected it."""
    new: int = 0
    nis: float = float("nan")
    """Mean of their squared innovations over their covariance; 2 is honest."""


class PointEkf:
    """Predict, associate by eq. (13), correct by eqs. (10) and (11), add what is new.

    The state is that of lines, whose two numbers a landmark are a point's x and y here.
    """

    def __init__(self, state: LineState, motion: MotionModel, options: PointEkfOptions) -> None:
        """state: without any landmark."""
        self.state = state
        self._motion, self._options = motion, options

    def step(self, observation: Observation, sight: PointSight) -> PointsTold:
        """Take one observation."""
        before = self.state.pose.copy()
        predict(self.state, self._motion, observation, lambda step: step.by_pose)
        told = self.look(observation, sight)
        self._motion.learn(before, self.state.pose.copy())
        return told

    def look(self, observation: Observation, sight: PointSight) -> PointsTold:
        """Correct pose and map by what one observation shows, and let the map grow."""
        seen = sight.points(observation, self.state.pose)
        if seen is None or not len(seen):
            return PointsTold()
        R = np.diag(sight.sigmas**2)
        which, of_map, new = self._associate(seen, R)
        fits = [self._correct(seen[i], R, j) for i, j in zip(which, of_map, strict=True)]
        for measured in seen[new]:
            point, by_pose, by_measured = seen_at(measured, self.state.pose)
            noise = by_measured @ R @ by_measured.T
            self.state.add(point, range(POSE), by_pose, noise)
        return PointsTold(
            len(seen), len(fits), len(new), float(np.mean(fits)) if fits else float("nan")
        )

    def known(self) -> PointMap:
        """The points as they are known now."""
        state = self.state
        return PointMap(state.lines.copy(), state.covariance(range(state.head, state.size)))

    def _associate(
        self, seen: Array, R: Array
    ) -> tuple[NDArray[np.intp], NDArray[np.intp], NDArray[np.intp]]:
        """Which were seen, (k,), of which points of the map, (k,), and which are new, (l,)."""
        everything = np.arange(len(seen))
        if not len(self.state):
            return everything[:0], everything[:0], everything
        H = self._jacobians()
        S = H @ self._covariances() @ H.transpose(0, 2, 1) + R
        nu = seen[:, None] - polar(self.state.lines, self.state.pose)
        nu[..., 1] = wrap(nu[..., 1])
        d2 = np.einsum("mni,nij,mnj->mn", nu, np.linalg.inv(S), nu)  # eq. (13)
        score = np.where(d2 < self._options.gate, d2 + np.log(np.linalg.det(S)), np.inf)
        likeliest = np.argmin(score, axis=1)
        known = np.isfinite(score.min(axis=1))
        new = d2.min(axis=1) > self._options.new_above
        return everything[known], likeliest[known], everything[new]

    def _correct(self, measured: Array, R: Array, point: int) -> float:
        """By one point; its squared innovation over its covariance."""
        state = self.state
        nu = measured - polar(state.lines[point : point + 1], state.pose)[0]
        nu[1] = wrap(nu[1])
        indices = np.array([0, 1, 2, *state.states_of(point)], dtype=np.intp)
        W = np.zeros((2, len(state.mean)))
        H = self._jacobians()[point]
        change, fit = correct(state.buffer, state.size, W, 0, indices, H, R, nu, np.inf)
        absorb(state.buffer, state.size, W, 2)
        state.mean[: state.size] += change
        state.pose[2] = wrap(state.pose[2])
        return float(fit)

    def _jacobians(self) -> Array:
        return polar_jacobians(self.state.lines, self.state.pose, printed=self._options.printed)

    def _covariances(self) -> Array:
        """(n, 5, 5) of the pose and each point."""
        state, n = self.state, len(self.state)
        C = np.empty((n, 5, 5))
        cross = state.buffer[:POSE, state.head : state.size].reshape(POSE, n, 2)
        C[:, :POSE, :POSE] = state.pose_covariance
        C[:, :POSE, POSE:] = cross.transpose(1, 0, 2)
        C[:, POSE:, :POSE] = cross.transpose(1, 2, 0)
        C[:, POSE:, POSE:] = state.line_covariances()
        return C
