"""Where no tracks drive: the same prediction, and an inclination that speeding up does not tilt."""

import numpy as np

from grouser.estimators.cruise_predictor import CruisePredictor
from grouser.estimators.inclination import GRAVITY, Inclination
from grouser.estimators.inclined_predictor import InclinedPredictor
from grouser.geometry import Array
from grouser.rig import Imu

DT, STEPS = 0.1, 40
IMU = Imu(sigma_acceleration=0.05, sigma_rate=0.002)


def shown(step: int, ahead: float) -> dict[str, Array]:
    """On level ground, at an acceleration ahead [m/s^2]."""
    imu = np.array([ahead, 0.0, GRAVITY, 0.0, 0.0, 0.0])
    return {"imu": imu, "stamp": np.array([DT * step])}


def test_what_is_predicted_is_not_taken_for_a_slope() -> None:
    cruise, followed = CruisePredictor(DT), Inclination(IMU, shown(0, 0.0))
    inclined, unknowing = InclinedPredictor(cruise, followed), Inclination(IMU, shown(0, 0.0))
    assert inclined.errors is cruise.errors and inclined.measures == cruise.measures
    for step in range(1, STEPS):
        faster = 0.3 if step < STEPS / 2 else 0.0
        # What the filter estimates of a robot that speeds up: its speed and its turn, by the frame.
        biases = np.array([min(step, STEPS // 2) * 0.3 * DT**2, 0.0])
        seen = shown(step, faster)
        told, other = inclined.predict(seen, biases), cruise.predict(seen, biases)
        assert np.array_equal(told.pose, other.pose)
        assert np.array_equal(told.covariance, other.covariance)
        unknowing.follow(seen, np.zeros(3))
        if step == STEPS // 2 - 1:
            assert followed.vertical is not None and abs(followed.vertical[0]) < 1e-3
            assert unknowing.vertical is not None and abs(unknowing.vertical[0]) > 5e-3
