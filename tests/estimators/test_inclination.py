"""Which way is up: against rotations that are integrated apart from it, with noise and bias."""

import math

import numpy as np
import pytest

from grouser.estimators.inclination import (
    GRAVITY,
    Inclination,
    InclinationOptions,
    levelling,
)
from grouser.geometry import Array, rotation_from_rpy, so3_exp
from grouser.rig import Imu

IMU = Imu(sigma_acceleration=0.05, sigma_rate=0.002)
DT = 0.1
LEVEL = np.array([0.0, 0.0, GRAVITY, 0.0, 0.0, 0.0])


def shown(step: int, imu: Array, read_at: float | None = None) -> dict[str, Array]:
    seen = {"imu": imu, "stamp": np.array([DT * step])}
    return seen if read_at is None else seen | {"imu_stamp": np.array([read_at])}


def standing(first: Array = LEVEL) -> Inclination:
    return Inclination(IMU, shown(0, first))


def rocking(seed: int, *, bias: float = 0.0, shocks: float = 0.0) -> tuple[Array, Array]:
    """(n, 2) errors of the vertical's x and y, and (n,) sigmas, of a robot that rocks and turns."""
    rng = np.random.default_rng(seed)
    R = rotation_from_rpy(0.0, 0.0, 0.3)
    inclination = standing()
    errors, sigmas = [], []
    for k in range(1, 400):
        rate = np.array([0.3 * math.sin(0.9 * k), 0.5 * math.cos(0.3 * k), 0.4])
        R = R @ so3_exp(rate * DT)
        force = R.T @ [0.0, 0.0, GRAVITY] + 0.05 * rng.standard_normal(3)
        force += shocks * (rng.random() < 0.1) * rng.standard_normal(3)
        told = rate + bias * np.array([1.0, -1.0, 0.0]) + 0.002 * rng.standard_normal(3)
        inclination.follow(shown(k, np.append(force, told)), np.array([0.0, 0.0, 0.4 * DT]))
        up = inclination.levelling
        assert up is not None
        errors.append((up[2] - R[2])[:2])
        sigmas.append(inclination.sigma)
    return np.array(errors), np.array(sigmas)


@pytest.mark.parametrize("options", [{}, {"bias": 0.005}, {"shocks": 5.0}])
def test_it_knows_the_vertical_as_well_as_it_says(options: dict[str, float]) -> None:
    runs = [rocking(seed, **options) for seed in range(4)]
    off = np.array([errors[50:] / sigmas[50:, None] for errors, sigmas in runs])
    assert np.sqrt(np.mean(off**2)) < 1.3
    assert max(float(sigmas[-1]) for _, sigmas in runs) < np.radians(0.4)
    worst = max(float(np.abs(errors[50:]).max()) for errors, _ in runs)
    assert worst < np.radians(1.5), "the robot rocks by twenty degrees"


def test_level_axes_head_as_the_robot_does() -> None:
    R = rotation_from_rpy(0.2, -0.3, 0.7)
    level = levelling(R[2])
    np.testing.assert_allclose(level @ level.T, np.eye(3), atol=1e-12)
    np.testing.assert_allclose(level @ R[2], [0, 0, 1], atol=1e-12)
    heading = math.atan2(R[1, 0], R[0, 0])
    np.testing.assert_allclose(rotation_from_rpy(0, 0, heading) @ level, R, atol=1e-12)


def test_what_the_motion_tells_is_no_tilt() -> None:
    """A curve at 1 m/s and 0.5 rad/s pulls to the side by 0.5 m/s^2 for as long as it lasts."""
    knowing, not_knowing = standing(), standing()
    pulled = LEVEL + [0.0, 0.5, 0.0, 0.0, 0.0, 0.5]
    for k in range(1, 100):
        knowing.follow(shown(k, pulled), np.array([0.1, 0.0, 0.05]))
        not_knowing.follow(shown(k, pulled), None)
    for one, least, most in ((knowing, 0, 0.1), (not_knowing, 1, 4)):
        up = one.levelling
        assert up is not None and least <= np.degrees(np.linalg.norm(up[2, :2])) <= most


@pytest.mark.parametrize("every", [1, 3])
def test_the_motion_between_two_readings_is_all_that_was_driven_meanwhile(every: int) -> None:
    """Between rest and 1.5 m/s and back in 8 s, with a unit that is read at every frame or seldom,
    and tells the mean since it was read last."""

    def speed(time: float) -> float:
        return 0.75 - 0.75 * math.cos(2 * math.pi * time / 8)

    inclination, read_at, felt, worst = standing(), 0.0, LEVEL, 0.0
    for k in range(1, 241):
        now = DT * k
        if k % every == 0:
            change = (speed(now) - speed(read_at)) / (now - read_at)
            read_at, felt = now, LEVEL + [change, 0.0, 0.0, 0.0, 0.0, 0.0]
        way = DT * speed(now - DT / 2)
        inclination.follow(shown(k, felt, read_at), np.array([way, 0.0, 0.0]))
        if read_at == now:
            up = inclination.levelling
            assert up is not None
            worst = max(worst, float(np.degrees(np.linalg.norm(up[2, :2]))))
    assert worst < 0.6


def test_who_hears_nothing_knows_less_and_then_nothing() -> None:
    dead = standing()
    for k in range(1, 3):
        dead.follow(shown(k, np.zeros(6)), None)
    assert dead.levelling is None
    late = standing()
    late.follow(shown(1, LEVEL, read_at=0.1), None)
    assert late.levelling is not None
    late.follow(shown(3, LEVEL, read_at=0.15), None)
    assert late.levelling is None and late.sigma == math.inf
    assert standing(np.zeros(6)).levelling is None


def test_options_out_of_range_are_refused() -> None:
    with pytest.raises(ValueError, match=r"InclinationOptions\.acceleration must be positive, got"):
        InclinationOptions(acceleration=0.0)
