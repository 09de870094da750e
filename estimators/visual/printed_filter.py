"""Paper 1's Kalman filter as printed: F = I, the composed pose as measurement, constant Q and R.

Its covariance means little (SPEC 1.5): what is measured is composed from the state itself, and
neither Q nor R knows the frame. With constant Q and R it settles on a fixed blend of the two.
"""

import numpy as np

from grouser.estimators.visual.constant_errors import ConstantErrors
from grouser.estimators.visual.fusion import Accumulated, FilterState, Fused, RelativePose
from grouser.geometry import Array, between, compose, wrap

_Q = np.diag([0.01, 0.01, np.radians(0.5)]) ** 2  # m^2, m^2, rad^2 a frame; the paper gives none
_R = np.diag([0.01, 0.01, np.radians(0.5)]) ** 2


class PrintedFilter:
    """State (x, y, heading) of eq. (7); the predictor's constant errors are taken to be none."""

    def __init__(self, errors: ConstantErrors) -> None:
        self._errors = len(errors)
        self._last = FilterState(np.zeros(3), np.zeros(self._errors + 1), np.zeros((3, 3)))

    def of_predictor(self) -> tuple[Array, Array]:
        """Nothing is learnt of the predictor's errors: zeros (n,) and (n, n)."""
        return np.zeros(self._errors), np.zeros((self._errors, self._errors))

    def coast(self, predicted: Accumulated, start: FilterState | None = None) -> Fused:
        """Eqs. (6) to (11) alone."""
        start = start or self._last
        covariance = _predicted(start, predicted)
        return self._state(compose(start.pose, predicted.pose), covariance)

    def doubt(
        self, predicted: Accumulated, anchor: Array, start: FilterState | None = None
    ) -> Fused:
        """The paper never doubts its tracks."""
        return self.coast(predicted, start)

    def follow(self, measured: RelativePose, frames: int) -> Fused:
        """Without tracks the measurement is all there is."""
        return self._state(compose(self._last.pose, measured.pose), self._last.covariance + _R)

    def fuse(self, predicted: Accumulated, measured: RelativePose) -> Fused:
        """Prediction and update, with H = I."""
        x, P = compose(self._last.pose, predicted.pose), _predicted(self._last, predicted)
        z = compose(self._last.pose, measured.pose)
        innovation = np.append(z[:2] - x[:2], wrap(z[2] - x[2]))
        S = P + _R
        K = P @ np.linalg.inv(S)
        pose = x + K @ innovation
        pose[2] = wrap(pose[2])
        nis = float(innovation @ np.linalg.solve(S, innovation))
        return Fused(self._state(pose, P - K @ P).state, nis, False)

    def believe(self, fused: Fused, measured: RelativePose, frames: int) -> None:
        """The paper does not learn how good its tracks are."""

    def relative(self, fused: Fused, start: FilterState | None = None) -> Array:
        """(3,) the fused pose as seen from a state, by default that of the frame before."""
        return between((start or self._last).pose, fused.state.pose)

    def commit(self, fused: Fused) -> None:
        """The current frame is the next one's last."""
        self._last = fused.state

    def offset(self) -> tuple[float, float]:
        """Of the disparity offset nothing is known, px."""
        return 0.0, np.inf

    def observe_offset(self, offset: float, sigma: float) -> None:
        """The paper does not correct its disparities."""

    def doubt_offset(self, sigma: float) -> None:
        """Nor does it believe anything of them that it could doubt."""

    def _state(self, pose: Array, covariance: Array) -> Fused:
        covariance = (covariance + covariance.T) / 2
        return Fused(FilterState(pose, self._last.biases, covariance), np.nan, False)


def _predicted(start: FilterState, predicted: Accumulated) -> Array:
    """F P F^T + Q with F = I, eq. (9), for every frame since the start."""
    return np.asarray(start.covariance + predicted.frames * _Q)
