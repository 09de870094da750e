"""The inertial unit feels gravity, centripetal acceleration and turning, and what is wrong."""

import numpy as np
import pytest

from grouser.envs.sensors.imu import InertialUnit
from grouser.envs.sensors.schedule import Schedule
from grouser.envs.simulation.motion import Motion
from grouser.envs.simulation.tracks import GRAVITY
from grouser.envs.simulation.worlds.registry import make_world
from grouser.geometry import Array
from tests.envs.sensors.motions import at_rest, drive, generators, quiet, readings

WORLD = make_world("yard", np.random.default_rng(0))
REST = at_rest(np.eye(4))
AT_REST = np.array([0, 0, GRAVITY, 0, 0, 0])


def measured(motions: list[Motion], seed: int = 0, **effects: float) -> Array:
    amounts = quiet({f"imu.{name}": amount for name, amount in effects.items()})
    return np.array(
        [r["imu"] for r in readings(InertialUnit(dt=0.1), WORLD, motions, amounts, seed=seed)]
    )


def test_at_rest_it_feels_the_ground_push_up() -> None:
    imu = measured(drive(WORLD, [(0.0, 0.0)] * 3))
    np.testing.assert_allclose(imu, [AT_REST] * 4, atol=2e-3)


def test_noise_has_the_stated_size() -> None:
    imu = measured([REST] * 1000, acceleration_noise=0.2, rate_noise=0.01)
    np.testing.assert_allclose(imu.std(axis=0), [0.2] * 3 + [0.01] * 3, rtol=0.1)


def test_speeding_up_adds_up_to_the_speed() -> None:
    motions = drive(WORLD, [(0.4, 0.4)] * 12)
    assert measured(motions)[1:, 0].sum() * 0.1 == pytest.approx(0.4, rel=0.02)
    assert motions[-1].twist[0] == pytest.approx(0.4, rel=0.02)


def test_a_curve_is_felt_as_it_is_driven() -> None:
    motions = drive(WORLD, [(0.45, 0.2)] * 30)
    imu, (vx, _, rate) = measured(motions), motions[-1].twist
    assert imu[-1, 5] == pytest.approx(rate, abs=1e-6)
    assert imu[-1, 1] == pytest.approx(vx * rate, abs=0.02)  # towards the centre of the curve


def test_a_slow_unit_reads_the_mean_over_its_period() -> None:
    motions = drive(WORLD, [(0.4, 0.1)] * 8)
    each = measured(motions)
    sensor = InertialUnit(dt=0.1)
    sensor.enter(WORLD, generators(0))
    for motion in motions:
        sensor.advance(motion)
    np.testing.assert_allclose(sensor.read(motions[-1], quiet())["imu"], each.mean(axis=0))


def test_a_bias_is_added_to_every_axis() -> None:
    imu = measured([REST], acceleration_bias=0.3, rate_bias=-0.02)
    np.testing.assert_allclose(imu[0] - AT_REST, [0.3] * 3 + [-0.02] * 3)


def test_the_walks_variance_grows_linearly() -> None:
    """As walk^2 t: of 6 axes in 300 episodes, after 2 s and after 8 s."""
    walked = np.array(
        [
            measured([REST] * 80, seed, acceleration_walk=0.1, rate_walk=0.01) - AT_REST
            for seed in range(150)
        ]
    ) / np.repeat([0.1, 0.01], 3)
    for steps in (20, 80):
        assert walked[:, steps - 1].var() == pytest.approx(0.1 * steps, rel=0.15)


def test_a_walk_does_not_touch_the_noise() -> None:
    noise = measured([REST] * 5, rate_noise=0.01)
    both = measured([REST] * 5, rate_noise=0.01, rate_walk=0.1)
    walk = measured([REST] * 5, rate_walk=0.1)
    np.testing.assert_allclose(both, noise + walk - AT_REST, atol=1e-12)


def test_a_dead_unit_reads_zeros_and_comes_back() -> None:
    fault = {"what": "imu.dead", "start": 0.2, "end": 0.4}
    with_fault, without = Schedule(faults=[fault]), Schedule()
    rows = []
    for schedule in (with_fault, without):
        sensor = InertialUnit(dt=0.1)
        sensor.enter(WORLD, generators(0))
        shown = []
        for k in range(6):
            sensor.advance(REST)
            shown.append(sensor.read(REST, schedule.at(k * 0.1))["imu"])
        rows.append(np.array(shown))
    dead, alive = rows
    assert np.all(dead[2:4] == 0)
    assert np.array_equal(dead[[0, 1, 4, 5]], alive[[0, 1, 4, 5]])


def test_readings_saturate_at_full_scale() -> None:
    imu = measured([REST] * 50, acceleration_noise=100.0, rate_noise=10.0)
    space = InertialUnit(dt=0.1).spaces["imu"]
    assert all(space.contains(row) for row in imu)
    assert np.abs(imu[:, :3]).max() == pytest.approx(16 * 9.81)
