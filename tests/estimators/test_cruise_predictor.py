"""A motion of nearly constant velocity, as a filter's prediction."""

import numpy as np
import pytest

from grouser.estimators.cruise_predictor import CruisePredictor
from grouser.estimators.joint_state import JointState
from grouser.geometry import Array, compose, exp


def test_the_derivative_by_speed_and_turn_rate_is_that_of_finite_differences() -> None:
    predictor, at, h = CruisePredictor(0.1), np.array([0.05, 0.04]), 1e-6

    def pose(biases: Array) -> Array:
        return predictor.predict({}, biases).pose

    found = predictor.predict({}, at).by_biases
    numeric = [(pose(at + h * e) - pose(at - h * e)) / (2 * h) for e in np.eye(2)]
    assert np.abs(found - np.column_stack(numeric)).max() < 1e-9


def test_seen_motions_teach_the_speed_and_in_the_dark_it_goes_on_and_becomes_uncertain() -> None:
    predictor, truth = CruisePredictor(0.1), np.zeros(3)
    state = JointState.at_start(predictor.errors.sigmas)
    for _ in range(10):
        state = state.then(predictor.predict({}, state.biases)).wandered(predictor.errors.walks)
        truth = compose(truth, exp([0.05, 0.0, 0.03]))
        seen = state.sees_relative(truth, 1e-8 * np.eye(3), np.zeros((3, 2)))
        state = state.corrected(seen)
    assert state.biases == pytest.approx([0.05, 0.03], abs=1e-4)
    before = np.trace(state.pose_covariance)
    for _ in range(10):
        state = state.then(predictor.predict({}, state.biases)).wandered(predictor.errors.walks)
        truth = compose(truth, exp([0.05, 0.0, 0.03]))
    assert np.abs(state.pose - truth).max() < 0.01
    # A speed that wanders by 1 m/s^2 dt a frame: after 1 s, sqrt(sum of (k dt)^2) dt.
    expected = 0.01 * np.sqrt(sum(k**2 for k in range(10)))
    assert np.sqrt(state.pose_covariance[0, 0]) == pytest.approx(expected, rel=0.3)
    assert np.trace(state.pose_covariance) > 100 * before


def test_options_out_of_range_are_refused() -> None:
    with pytest.raises(ValueError, match="_acceleration must be positive, got 0"):
        CruisePredictor(0.1, acceleration=0.0)
