"""A track that spins while the gyroscope feels the robot stand: the way is in doubt."""

import numpy as np
import pytest

from grouser.estimators import make
from grouser.estimators.gyro import Gyro, GyroOptions
from grouser.estimators.icr_predictor import IcrOptions, IcrPredictor
from grouser.estimators.spinning import SpinningPredictor, lost_way_variance
from grouser.geometry import Array, compose
from grouser.rig import Imu, Rig, TrackGeometry

GRAVITY = 9.81
TRACKS = TrackGeometry(gauge=0.4, width=0.08, effective_width=0.6)
IMU = Imu(sigma_acceleration=0.05, sigma_rate=0.002)
NAN = np.full(2, np.nan)


def shown(step: int, du: Array, turn: float, read_at: float | None = None) -> dict[str, Array]:
    imu = np.array([0.0, 0.0, GRAVITY, 0.0, 0.0, turn / 0.1])
    seen = {"tracks": du, "imu": imu, "stamp": np.array([0.1 * step])}
    return seen if read_at is None else seen | {"imu_stamp": np.array([read_at])}


def predictors() -> tuple[SpinningPredictor, IcrPredictor]:
    """One that doubts, and the same without a doubt."""
    gyro = Gyro(IMU, 0.1, GyroOptions())
    gyro.reset(shown(0, np.zeros(2), 0.0))
    doubting = SpinningPredictor(IcrPredictor(TRACKS, IcrOptions()), gyro, 0.6)
    return doubting, IcrPredictor(TRACKS, IcrOptions())


def doubt(du: Array, turn: float) -> Array:
    """(3, 3) covariance that is added where the robot turns by `turn`."""
    doubting, other = predictors()
    seen, none = shown(1, du, turn), np.zeros(7)
    told, without = doubting.predict(seen, none), other.predict(seen, none)
    assert np.array_equal(told.pose, without.pose)
    assert np.array_equal(told.by_biases, without.by_biases)
    return np.asarray(told.covariance - without.covariance)


def test_turns_as_told_and_tracks_that_slide_sideways_leave_no_doubt() -> None:
    assert not doubt(np.array([0.03, 0.05]), 0.02 / 0.6).any()
    assert not doubt(np.array([-0.03, 0.03]), 0.95 * 0.06 / 0.6).any()


def test_a_track_that_spins_takes_half_of_what_it_lost_from_the_way() -> None:
    """The right one of 40 mm tracks the robot does not follow: it turns to the right instead."""
    spun = doubt(np.array([0.04, 0.04]), -0.04 / 0.6)
    assert spun[0, 0] == pytest.approx(25 * 0.02**2)
    assert np.count_nonzero(spun) == 1
    assert lost_way_variance(0.01, 0.04) == pytest.approx(0.005**2)
    assert lost_way_variance(0.005, 0.04) == 0.0 == lost_way_variance(0.02, np.inf)


def test_a_slow_unit_is_compared_with_the_steps_since_its_last_reading() -> None:
    doubting, other = predictors()
    du, turn = np.array([0.03, 0.05]), 0.02 / 0.6
    for step in range(1, 9):
        read_at = 0.1 * (step - step % 2)
        seen, none = shown(step, du, turn, read_at), np.zeros(7)
        more = doubting.predict(seen, none).covariance - other.predict(seen, none).covariance
        assert not more.any()


def test_silent_tracks_told_no_turn_to_compare_with() -> None:
    doubting, other = predictors()
    for step, du in enumerate((np.array([0.04, 0.04]), NAN, NAN), start=1):
        seen, none = shown(step, du, -0.04 / 0.6 * np.isnan(du[0])), np.zeros(7)
        told, without = doubting.predict(seen, none), other.predict(seen, none)
        assert np.array_equal(told.covariance, without.covariance)


def test_at_a_rock_the_filter_doubts_how_far_it_came() -> None:
    """Two seconds in which one track spins, after two and before two that go well."""
    rig = Rig(dt=0.1, tracks=TRACKS, imu=IMU)
    rng, du = np.random.default_rng(0), np.array([0.04, 0.04])
    estimator = make("icr-ekf", rig)
    estimator.reset(shown(0, np.zeros(2), 0.0), rng=rng)
    truth = np.zeros(3)
    for step in range(1, 61):
        spins = 20 <= step < 40
        moved = np.array([0.02, 0.0, -0.04 / 0.6]) if spins else np.array([0.04, 0.0, 0.0])
        truth = compose(truth, moved)
        last = estimator.update(shown(step, du, moved[2] + 2e-4 * rng.normal()))
    error = last.pose - truth
    error[2] = np.arctan2(np.sin(error[2]), np.cos(error[2]))
    assert np.hypot(*error[:2]) > 0.2
    assert error @ np.linalg.solve(last.covariance, error) < 7.8  # chi2_3(0.95)
