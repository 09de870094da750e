"""Tracks on slopes: the creep that an inertial unit tells, and the doubt where there is none."""

import numpy as np
import pytest

from grouser.estimators.icr_predictor import IcrOptions, IcrPredictor
from grouser.estimators.inclination import GRAVITY, Inclination
from grouser.estimators.slope import SlopeOptions, unknown_covariance
from grouser.estimators.slope_predictor import SlopePredictor, UnknownSlopePredictor
from grouser.geometry import Array, rotation_from_rpy
from grouser.rig import Imu, TrackGeometry

TRACKS = TrackGeometry(gauge=0.4, width=0.08, effective_width=0.6)
IMU = Imu(sigma_acceleration=0.05, sigma_rate=0.002)
BIASES = np.array([-0.03, 0.01, 0.04, 0.01, -0.02, 0.03, 0.02, 0.1, 0.02])
TILT = rotation_from_rpy(0.15, -0.2, 0.0)
DT = 0.1


def felt(R: Array) -> Array:
    return np.append(R.T @ [0.0, 0.0, GRAVITY], np.zeros(3))


def shown(du: tuple[float, float], step: int, imu: Array) -> dict[str, Array]:
    return {"tracks": np.array(du), "imu": imu, "stamp": np.array([DT * step])}


def tilted(R: Array = TILT, imu: Imu = IMU) -> SlopePredictor:
    """One that has stood on a slope for a while."""
    inclination = Inclination(imu, shown((0, 0), 0, felt(R)))
    level = IcrPredictor(TRACKS, IcrOptions())
    predictor = SlopePredictor(level, inclination, 0.6, SlopeOptions())
    for step in range(1, 50):
        predictor.predict(shown((0, 0), step, felt(R)), np.zeros(9))
    return predictor


@pytest.mark.parametrize("du", [(0.03, 0.05), (-0.03, -0.05), (-0.02, 0.03)])
def test_the_derivative_by_the_biases_is_that_of_finite_differences(
    du: tuple[float, float],
) -> None:
    h = 1e-6
    # Of a vertical that does not depend on the predicted speed, by which the force is corrected.
    deaf = Imu(sigma_acceleration=1e6, sigma_rate=0.002)

    def pose(biases: Array) -> Array:
        return tilted(imu=deaf).predict(shown(du, 50, felt(TILT)), biases).pose

    by_biases = tilted(imu=deaf).predict(shown(du, 50, felt(TILT)), BIASES).by_biases
    assert by_biases.shape == (3, len(tilted().errors))
    for k in range(9):
        step = h * np.eye(9)[k]
        expected = (pose(BIASES + step) - pose(BIASES - step)) / (2 * h)
        assert np.abs(by_biases[:, k] - expected).max() < 1e-8


def test_a_turn_on_the_spot_creeps_downhill_and_is_less_certain_than_on_level_ground() -> None:
    du = (-0.03, 0.03)
    on_slope = tilted().predict(shown(du, 50, felt(TILT)), np.zeros(9))
    on_level = tilted(np.eye(3)).predict(shown(du, 50, felt(np.eye(3))), np.zeros(9))
    crept, uphill = on_slope.pose[:2] - on_level.pose[:2], TILT[2, :2]
    expected = -0.85 * 0.6 * 0.1 * uphill
    assert crept == pytest.approx(expected, abs=2e-4)
    assert (np.linalg.eigvalsh(on_slope.covariance - on_level.covariance) > 0).all()


def test_without_a_unit_or_with_a_dead_one_the_slope_is_unknown() -> None:
    du, step, options = (0.03, 0.05), 50, SlopeOptions()
    level = IcrPredictor(TRACKS, IcrOptions())
    without = UnknownSlopePredictor(IcrPredictor(TRACKS, IcrOptions()), 0.6, options)
    dead = tilted()
    for k in range(50, 60):
        step, _ = k, dead.predict(shown((0, 0), k, np.zeros(6)), np.zeros(9))
    expected = level.predict(shown(du, 1, felt(TILT)), np.zeros(7))
    for found in (
        without.predict(shown(du, 1, felt(TILT)), np.zeros(7)),
        dead.predict(shown(du, step + 1, np.zeros(6)), np.zeros(9)),
    ):
        assert found.pose == pytest.approx(expected.pose)
        more = found.covariance - expected.covariance
        assert more == pytest.approx(unknown_covariance(float(expected.pose[2]), 0.6, options))


def test_a_guess_of_silent_tracks_is_uncertain_enough() -> None:
    predictor = tilted()
    predictor.predict(shown((0.03, 0.05), 50, felt(TILT)), np.zeros(9))
    silent = shown((np.nan, np.nan), 51, felt(TILT))
    guess = predictor.predict(silent, np.zeros(9))
    assert not guess.measured and np.trace(guess.covariance[:2, :2]) > 0.04**2


def test_it_tells_how_far_it_creeps() -> None:
    predictor = tilted()
    predictor.predict(shown((0.03, 0.05), 50, felt(TILT)), BIASES)
    told = predictor.tell(BIASES, np.diag(np.arange(9.0) ** 2))
    assert told["creep"] == pytest.approx(0.85 * 0.6 + 0.1) and told["creep_sigma"] == 7.0
    assert "icr_left" in told
