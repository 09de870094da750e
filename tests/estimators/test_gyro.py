"""The gyroscope's turn: only of new readings, and of those that are of the motion up to now."""

import math

import numpy as np
import pytest

from grouser.estimators.gyro import Gyro, GyroOptions
from grouser.estimators.inclination import Inclination
from grouser.geometry import Array, rotation_from_rpy, so3_exp
from grouser.rig import Imu

IMU = Imu(sigma_acceleration=0.05, sigma_rate=0.002)
GRAVITY = 9.81


def shown(stamp: float, rate: float, read_at: float | None = None) -> dict[str, Array]:
    seen = {
        "imu": np.array([0.0, 0.0, GRAVITY, 0.0, 0.0, rate]),
        "stamp": np.array([stamp]),
    }
    return seen if read_at is None else seen | {"imu_stamp": np.array([read_at])}


def gyro(**options: float) -> Gyro:
    made = Gyro(IMU, 0.1, GyroOptions(**options))
    made.reset(shown(0.0, 0.0, 0.0))
    return made


def test_a_reading_is_the_mean_rate_since_the_last_one() -> None:
    turn = gyro(turn_share=0.0).read(shown(0.1, 0.5))
    assert turn is not None
    assert turn.angle == pytest.approx(0.05) and turn.duration == pytest.approx(0.1)
    assert turn.variance == pytest.approx((0.002 * 0.1) ** 2)


def test_a_slow_one_is_heard_when_it_reads_and_for_the_whole_time_since() -> None:
    slow = gyro()
    assert slow.read(shown(0.1, 0.0, 0.0)) is None and not slow.fresh
    turn = slow.read(shown(0.2, 0.5, 0.2))
    assert slow.fresh and turn is not None and turn.angle == pytest.approx(0.1)


def test_a_late_or_dead_one_says_nothing() -> None:
    late = gyro()
    assert late.read(shown(0.3, 0.5, 0.1)) is None and late.fresh
    dead = gyro()
    assert dead.read(shown(0.1, 0.0) | {"imu": np.zeros(6)}) is None and dead.fresh


def test_on_a_slope_the_turn_is_that_of_the_heading() -> None:
    """A robot that rocks as it turns: about its own z axis it turns by another angle."""
    R = rotation_from_rpy(0.2, -0.3, 0.0)
    at_rest = np.concatenate([R.T @ [0.0, 0.0, GRAVITY], np.zeros(3)])
    first = {"imu": at_rest, "stamp": np.array([0.0])}
    inclination = Inclination(IMU, first)
    levelled = Gyro(IMU, 0.1, GyroOptions(), inclination)
    levelled.reset(first)
    told, true, about_z = [], [], []
    for k in range(1, 150):
        rate = np.array([0.4 * math.sin(0.3 * k), 0.3 * math.cos(0.2 * k), 0.5])
        before, R = R, R @ so3_exp(rate * 0.1)
        imu = np.append(R.T @ [0.0, 0.0, GRAVITY], rate)
        seen = {"imu": imu, "stamp": np.array([0.1 * k])}
        inclination.follow(seen, np.zeros(3))
        turn = levelled.read(seen)
        assert turn is not None
        told.append(turn.angle)
        heading = [math.atan2(M[1, 0], M[0, 0]) for M in (before, R)]
        true.append(math.remainder(heading[1] - heading[0], 2 * math.pi))
        about_z.append(rate[2] * 0.1)
    settled = slice(50, None)
    off = np.array(told[settled]) - true[settled]
    assert np.abs(off).max() < 1e-3
    assert np.abs(np.array(about_z[settled]) - true[settled]).max() > 1e-2


def test_where_the_other_axes_are_silent_the_turn_is_that_about_its_own() -> None:
    first = {"imu": np.array([0.0, 0.0, GRAVITY, 0.0, 0.0, 0.0]), "stamp": np.array([0.0])}
    inclination = Inclination(IMU, first)
    one = Gyro(IMU, 0.1, GyroOptions(), inclination)
    one.reset(first)
    seen = shown(0.01, 0.5)
    seen["imu"][3] = np.nan
    inclination.follow(seen, np.zeros(3))
    assert inclination.vertical is not None
    turn = one.read(seen)
    assert turn is not None and turn.angle == pytest.approx(0.005)


def test_options_out_of_range_are_refused() -> None:
    with pytest.raises(ValueError, match=r"GyroOptions\.bias_sigma must be zero or more, got -1"):
        GyroOptions(bias_sigma=-1)
