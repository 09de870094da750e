"""Kalman filter of whatever predicts, relative poses, a gyroscope and satellite fixes.

Zhu et al. (reference [6] of the first paper) filter visual odometry, an inertial unit and satellite
fixes; Pentzer et al. (2014) tracks with unknown centres of rotation and a pose. This is both: the
biases are the constant errors of the predictor, then the gyroscope's bias [rad/s], and last the
cameras' disparity offset [px].
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from grouser.estimators.base import Observation
from grouser.estimators.gyro import Gyro
from grouser.estimators.joint_state import JointState, Measurement
from grouser.estimators.position_fixes import PositionFixes
from grouser.estimators.visual.constant_errors import (
    NO_ERRORS,
    ConstantErrors,
    disparity_offset,
)
from grouser.estimators.visual.fusion import SLIP_GATE, RelativePose
from grouser.estimators.visual.prediction import Increment
from grouser.geometry import Array

TURN_GATE, POSITION_GATE = 10.83, 13.82
"""chi-square of 1 and 2 degrees of freedom at 99.9 %"""
_SLIP_INFLATION = 100.0
_IMPOSSIBLE = 25.0
"""Squared sigmas between vision's turn and the gyroscope's, 5 of them, beyond which one is wrong"""
_BELIEVED_AT_LAST = 3
"""Fixes or turns in a row beyond the gate"""


@dataclass(frozen=True, slots=True, eq=False)
class Heard:
    """What gyroscope and receiver did to the state."""

    turn_nis: float = np.nan
    """Of the gyroscope's turn; beyond TURN_GATE the prediction slipped."""
    fix_nis: float = np.nan
    """Of the fix; beyond POSITION_GATE it was rejected."""

    @property
    def slipped(self) -> bool:
        """The gyroscope disagreed with the prediction."""
        return self.turn_nis > TURN_GATE

    @property
    def fixed(self) -> bool:
        """A fix was taken into account."""
        return self.fix_nis <= POSITION_GATE


@dataclass(frozen=True, slots=True, eq=False)
class JointFused:
    """The state after a relative pose."""

    state: JointState
    nis: float
    """NaN where there was none"""
    slipped: bool


class JointFilter:
    """Predicts, hears gyroscope and receiver, and looks at relative poses.

    What is heard stays. A relative pose is of the keyframe, whose errors all of them share: so each
    gives an estimate of its own, `fuse`, and only the one that `commit` is called with stays. The
    last one is led on by what is predicted and heard: where no other comes, it is what is known.
    """

    def __init__(
        self,
        errors: ConstantErrors,
        *,
        gyro: Gyro | None,
        fixes: PositionFixes | None,
        disparity_sigma: float = 0.0,
    ) -> None:
        """
        Args:
            errors: the predictor's.
            disparity_sigma: how well the disparity offset is known, px.
        """
        self._gyro, self._fixes = gyro, fixes
        self._errors = errors + (gyro.errors if gyro else NO_ERRORS)
        self._every = self._errors + disparity_offset(disparity_sigma)
        self._predicted = len(errors)

    def reset(self, observation: Observation) -> None:
        """Start at pose zero with the first observation."""
        self.state = self._last = JointState.at_start(self._every.sigmas)
        self._rejected, self._disbelieved, self._turned = 0, 0, False
        if self._gyro:
            self._gyro.reset(observation)
        if self._fixes:
            self._fixes.reset(observation)

    def of_predictor(self) -> tuple[Array, Array]:
        """Its constant errors (n,) as estimated, and their covariance (n, n)."""
        n = self._predicted
        return self.state.biases[:n], self.state.bias_covariance[:n, :n]

    @property
    def gyro_bias(self) -> tuple[float, float]:
        """rad/s, and its sigma; NaN without a gyroscope."""
        if self._gyro is None:
            return np.nan, np.nan
        k = self._predicted
        return float(self.state.biases[k]), float(np.sqrt(self.state.bias_covariance[k, k]))

    def predict(self, increment: Increment) -> None:
        """One increment on."""
        biases, _ = self.of_predictor()

        def on(state: JointState) -> JointState:
            known = increment.corrected(state.biases[: len(biases)] - biases)
            return state.then(known).wandered(self._every.walks)

        self._change(on)

    def hear(self, observation: Observation, *, blind: bool) -> Heard:
        """Take the turn and the fix of an observation into account, where there are new ones.

        Args:
            blind: nothing but the prediction contradicts a fix that is beyond the gate. Then a few
                of them in a row say that the prediction is wrong: tracks may spin at a wall.
        """
        turn_nis = self._hear_turn(self._gyro, observation) if self._gyro else np.nan
        self._turned = not np.isnan(turn_nis)
        fix_nis = self._hear_fix(self._fixes, observation, blind) if self._fixes else np.nan
        return Heard(turn_nis, fix_nis)

    def disbelieves(self, seen: RelativePose, *, alone: bool) -> bool:
        """Whether vision turned as the gyroscope did not. Then it matched what does not belong
        together; but the third in a row is believed, as gyroscopes may fail, too.

        Args:
            alone: nothing that measures turned as the gyroscope did. Against two, vision is never
                believed.
        """
        turn = self._sees(seen).row(2)
        against = self._turned and self.state.nis(turn) > _IMPOSSIBLE
        self._disbelieved = self._disbelieved + 1 if against else 0
        return against and (not alone or self._disbelieved < _BELIEVED_AT_LAST)

    def fuse(self, seen: RelativePose) -> JointFused:
        """With the pose as seen from the keyframe; beyond the gate the prediction slipped."""
        measurement = self._sees(seen)
        nis = self.state.nis(measurement)
        slipped = nis > SLIP_GATE
        state = self.state.doubted(_SLIP_INFLATION) if slipped else self.state
        self._last = state.corrected(measurement)
        return JointFused(self._last, nis, slipped)

    def _sees(self, seen: RelativePose) -> Measurement:
        by_biases = np.zeros((3, len(self._every)))
        by_biases[:, -1] = seen.by_disparity
        return self.state.sees_relative(seen.pose, seen.covariance, by_biases)

    def coast(self) -> JointFused:
        """Without one: the last estimate, led on."""
        return JointFused(self._last, np.nan, False)

    def resume(self, state: JointState) -> None:
        """An estimate made earlier is the last one."""
        self.state = self._last = state

    def commit(self, fused: JointFused) -> None:
        """The pose now becomes the keyframe."""
        self.state = self._last = fused.state.with_keyframe()

    def _change(self, changed: Callable[[JointState], JointState]) -> None:
        """What is predicted or heard changes the state since the keyframe and the last estimate."""
        alone = self._last is self.state
        self.state = changed(self.state)
        self._last = self.state if alone else changed(self._last)

    def _hear_turn(self, gyro: Gyro, observation: Observation) -> float:
        turn, nis = gyro.read(observation), np.nan
        if turn is not None:
            by_biases = np.zeros(len(self._every))
            by_biases[self._predicted] = turn.duration
            seen = turn.angle, turn.variance, by_biases
            nis = self.state.nis(self.state.sees_turn(*seen))
            self._change(lambda state: _with_turn(state, *seen))
        if gyro.fresh:
            self._change(JointState.with_mark)
        return nis

    def _hear_fix(self, fixes: PositionFixes, observation: Observation, blind: bool) -> float:
        fix = fixes.new(observation, self.state.pose[:2])
        if fix is None:
            return np.nan
        measurement = self.state.sees_position(fix.position, fixes.sigma)
        nis = self.state.nis(measurement)
        self._rejected = 0 if nis <= POSITION_GATE else self._rejected + 1
        if blind and self._rejected >= _BELIEVED_AT_LAST:
            off = float(np.linalg.norm(measurement.innovation))
            self._change(lambda state: state.displaced(off))
            self._rejected, nis = 0, self.state.nis(measurement)
        self._change(lambda state: _with_fix(state, fix.position, fixes.sigma))
        return nis


def _with_turn(state: JointState, turn: float, variance: float, by_biases: Array) -> JointState:
    """With a gyroscope's turn; beyond the gate the prediction slipped."""
    measurement = state.sees_turn(turn, variance, by_biases)
    doubted = state.nis(measurement) > TURN_GATE
    return (state.doubted(_SLIP_INFLATION) if doubted else state).corrected(measurement)


def _with_fix(state: JointState, position: Array, sigma: float) -> JointState:
    """With a satellite fix, unless it is beyond the gate."""
    measurement = state.sees_position(position, sigma)
    return state.corrected(measurement) if state.nis(measurement) <= POSITION_GATE else state
