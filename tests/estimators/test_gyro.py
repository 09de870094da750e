"""The gyroscope's turn: only of new readings, and of those that are of the motion up to now."""

import numpy as np
import pytest

from grouser.estimators.gyro import Gyro, GyroOptions
from grouser.geometry import Array
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


def test_options_out_of_range_are_refused() -> None:
    with pytest.raises(ValueError, match=r"GyroOptions\.bias_sigma must be zero or more, got -1"):
        GyroOptions(bias_sigma=-1)
