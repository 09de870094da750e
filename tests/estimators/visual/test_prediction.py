"""What is expected of the next frame: from the tracks with their derivatives, or as the last."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from grouser.estimators.base import Observation
from grouser.estimators.track_motion import SideSlip, TrackNoise, arc_pose
from grouser.estimators.visual.planar_motion import pose_motion
from grouser.estimators.visual.prediction import ScaleOptions, TrackPredictor, VelocityPredictor
from grouser.geometry import Array
from grouser.rig import TrackGeometry

WIDTH = 0.5
TRACKS = TrackGeometry(gauge=0.4, width=0.08, effective_width=WIDTH)
PREDICTOR = TrackPredictor(TRACKS, ScaleOptions(transient_noise=0.0))
BIASES = len(PREDICTOR.errors)
lengths = st.floats(-0.2, 0.2)
errors = st.floats(-0.1, 0.1)
constants = st.tuples(errors, errors, errors, errors).map(np.array)


def tracks(left: float, right: float) -> Observation:
    return {"tracks": np.array([left, right])}


@given(lengths, lengths, constants)
def test_the_increment_is_the_exact_arc_of_the_corrected_tracks_and_a_share_of_it_across(
    left: float, right: float, biases: Array
) -> None:
    increment = PREDICTOR.predict(tracks(left, right), biases)
    true_left, true_right = left * (1 + biases[0]), right * (1 + biases[1])
    turn = (true_right - true_left) / WIDTH * (1 + biases[2])
    forward, left_, _ = arc_pose(turn, (true_left + true_right) / 2)
    expected = [forward - biases[3] * left_, left_ + biases[3] * forward, turn]
    np.testing.assert_allclose(increment.pose, expected, atol=1e-12)


@given(lengths, lengths, constants)
def test_derivatives_by_constant_errors_agree_with_finite_differences(
    left: float, right: float, biases: Array
) -> None:
    h, seen = 1e-6, tracks(left, right)
    by_biases = PREDICTOR.predict(seen, biases).by_biases
    assert by_biases.shape == (3, BIASES)
    for k in range(BIASES):
        step = h * np.eye(BIASES)[k]
        ahead, back = (PREDICTOR.predict(seen, s).pose for s in (biases + step, biases - step))
        assert np.abs(by_biases[:, k] - (ahead - back) / (2 * h)).max() < 1e-8


@given(lengths, lengths)
def test_the_covariance_is_one(left: float, right: float) -> None:
    covariance = PREDICTOR.predict(tracks(left, right), np.zeros(BIASES)).covariance
    np.testing.assert_allclose(covariance, covariance.T, atol=1e-18)
    assert np.linalg.eigvalsh(covariance)[0] >= -1e-18
    assert covariance[2, 2] > 0, "even a robot at rest may have turned a little"


def test_the_covariance_agrees_with_monte_carlo() -> None:
    """White noise of both tracks, of the turn, and across the half-angle frame."""
    left, right, draws = 0.08, 0.12, 4000
    rng, noise, slip = np.random.default_rng(0), TrackNoise(), SideSlip()
    drawn = np.empty((draws, 3))
    sigmas = np.sqrt(np.diag(noise.covariance(np.array([left, right]))))
    for i in range(draws):
        l_, r_ = np.array([left, right]) + sigmas * rng.normal(size=2)
        turn = (r_ - l_) / WIDTH + 0.05 * (right - left) / WIDTH * rng.normal()
        drawn[i] = arc_pose(turn, (l_ + r_) / 2)
        side = slip.sigma(turn, (l_ + r_) / 2) * rng.normal()
        drawn[i, :2] += side * np.array([-np.sin(turn / 2), np.cos(turn / 2)])
    increment = PREDICTOR.predict(tracks(left, right), np.zeros(BIASES))
    root = np.linalg.cholesky(increment.covariance)
    whitened = np.linalg.solve(root, (drawn - increment.pose).T)
    np.testing.assert_allclose(np.cov(whitened), np.eye(3), atol=0.1)


@pytest.mark.parametrize("bad", [np.array([np.inf, 0.0]), np.zeros(3)])
def test_bad_tracks_are_refused(bad: Array) -> None:
    with pytest.raises(ValueError, match=r"'tracks' must be two finite numbers \[m\], got"):
        PREDICTOR.predict({"tracks": bad}, np.zeros(BIASES))


@pytest.mark.parametrize("silent", [np.full(2, np.nan), np.array([0.1, np.nan])])
def test_tracks_that_report_nothing_leave_a_guess(silent: Array) -> None:
    """The last increment again, until nobody knows that either; neither is a measurement."""
    last = np.array([0.1, 0.0, 0.05])
    PREDICTOR.learn(last)
    guess = PREDICTOR.predict({"tracks": silent}, np.zeros(BIASES))
    assert not guess.measured and guess.by_biases.shape == (3, BIASES)
    np.testing.assert_allclose(guess.pose[[0, 2]], last[[0, 2]], atol=2e-3)
    PREDICTOR.learn(None)
    unknown = PREDICTOR.predict({"tracks": silent}, np.zeros(BIASES))
    assert not unknown.measured and not unknown.pose.any()
    assert (np.diag(unknown.covariance) > np.diag(guess.covariance)).all()


def test_the_tracks_measure_and_need_no_memory() -> None:
    seen = tracks(0.1, 0.12)
    before = PREDICTOR.predict(seen, np.zeros(BIASES))
    PREDICTOR.learn(np.array([5.0, 0.0, 1.0]))
    after = PREDICTOR.predict(seen, np.zeros(BIASES))
    assert before.measured and after.measured
    np.testing.assert_array_equal(before.pose, after.pose)


def test_a_change_of_speed_is_followed_late() -> None:
    """By a share of the change, along and around; the noise at a steady speed is as it was."""
    share, zero, now = 0.3, np.zeros(BIASES), tracks(0.1, 0.1)
    covariances = []
    for before in (None, tracks(0.1, 0.1), tracks(0.02, 0.1), tracks(np.nan, np.nan)):
        predictor = TrackPredictor(TRACKS, ScaleOptions(transient_noise=share))
        if before is not None:
            predictor.predict(tracks(0.0, 0.0), zero)
            predictor.predict(before, zero)
        covariances.append(predictor.predict(now, zero).covariance)
    first, steady, late, after_silence = covariances
    np.testing.assert_array_equal(first, steady)
    np.testing.assert_array_equal(first, after_silence)
    off = share * 0.08  # of the left track
    assert late[0, 0] - steady[0, 0] == pytest.approx((off / 2) ** 2)
    assert late[2, 2] - steady[2, 2] == pytest.approx((off / WIDTH) ** 2)


def test_without_tracks_the_last_increment_is_expected_again_but_for_its_slip() -> None:
    predictor, zero = VelocityPredictor(np.array([1.5, 0.1, 0.1])), np.zeros(BIASES)
    first = predictor.predict({}, zero)
    np.testing.assert_array_equal(first.pose, np.zeros(3))
    np.testing.assert_allclose(np.sqrt(np.diag(first.covariance)), [1.5, 0.1, 0.1])
    last = np.array([0.2, 0.01, 0.03])
    predictor.learn(last)
    again = predictor.predict({}, zero)
    turn, chord, _ = pose_motion(last)
    np.testing.assert_allclose(pose_motion(again.pose), [turn, chord, 0.0], atol=1e-15)
    assert (np.diag(again.covariance) < np.diag(first.covariance)).all()
    assert not again.by_biases.any()
    last[:] = 9.0
    np.testing.assert_array_equal(predictor.predict({}, zero).pose, again.pose)
    predictor.learn(None)
    np.testing.assert_array_equal(predictor.predict({}, zero).pose, np.zeros(3))


def test_a_faster_robot_is_expected_less_exactly() -> None:
    predictor = VelocityPredictor(np.ones(3))
    variances = []
    for speed in (0.0, 0.1, 1.0):
        predictor.learn(np.array([speed, 0.0, 0.0]))
        variances.append(np.diag(predictor.predict({}, np.zeros(BIASES)).covariance)[:2])
    assert (np.diff(variances, axis=0) > 0).all()
