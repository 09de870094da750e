"""Fixes are in the frame of the start; their errors have the sizes and the times they say."""

import numpy as np
import pytest

from grouser.envs.sensors.gps import SatelliteReceiver
from grouser.envs.sensors.schedule import Schedule
from grouser.envs.simulation.motion import Motion
from grouser.envs.simulation.worlds.registry import make_world
from grouser.geometry import Array, between, compose, lift
from tests.envs.sensors.motions import at_rest, generators, quiet, readings

WORLD = make_world("yard", np.random.default_rng(0))
REST = at_rest(np.eye(4))


def fixes(motions: list[Motion], seed: int = 0, **effects: float) -> Array:
    amounts = quiet({f"gps.{name}": amount for name, amount in effects.items()})
    read = readings(SatelliteReceiver(dt=0.1), WORLD, motions, amounts, seed=seed)
    return np.array([reading["gps"] for reading in read])


def test_a_fix_is_where_the_robot_is_in_the_frame_of_its_start() -> None:
    start = np.array([3.0, -2.0, 0.8])
    poses = [compose(start, np.array(p)) for p in ([0.0, 0, 0], [1.0, 0, 0.3], [2.0, 1.0, 0.9])]
    shown = fixes([at_rest(lift(pose)) for pose in poses])
    np.testing.assert_allclose(shown, [between(start, p)[:2] for p in poses], atol=1e-9)


def test_noise_is_white_and_of_the_stated_size() -> None:
    shown = fixes([REST] * 3000, noise=0.7)
    np.testing.assert_allclose(shown.std(axis=0), 0.7, rtol=0.05)
    assert abs(np.corrcoef(shown[1:, 0], shown[:-1, 0])[0, 1]) < 0.06


def test_the_drift_has_its_size_from_the_start_and_lasts_a_minute() -> None:
    """Standard deviation over 400 episodes; correlation 1 / e after 60 s."""
    shown = np.array([fixes([REST] * 2, seed, drift=2.0)[:, 0] for seed in range(400)])
    np.testing.assert_allclose(shown.std(axis=0), 2.0, rtol=0.1)
    assert np.corrcoef(shown.T)[0, 1] > 0.99
    sensor = SatelliteReceiver(dt=60.0)
    drift = quiet({"gps.drift": 2.0})
    episodes = [readings(sensor, WORLD, [REST] * 2, drift, seed=seed) for seed in range(600)]
    pairs = np.array([[reading["gps"][0] for reading in episode] for episode in episodes])
    assert np.corrcoef(pairs.T)[0, 1] == pytest.approx(np.exp(-1), abs=0.1)


def test_a_jump_is_of_its_size_and_in_one_direction_an_episode() -> None:
    shown = fixes([REST] * 3, jump=5.0)
    np.testing.assert_allclose(np.linalg.norm(shown, axis=1), 5.0)
    assert np.array_equal(shown[0], shown[2])
    assert not np.allclose(shown[0], fixes([REST], 1, jump=5.0)[0])


def test_in_an_outage_there_is_no_fix_and_the_space_knows() -> None:
    schedule = Schedule(faults=[{"what": "gps.outage", "start": 0.2, "end": 0.4}])
    sensor = SatelliteReceiver(dt=0.1)
    sensor.enter(WORLD, generators(0))
    shown = []
    for k in range(6):
        sensor.advance(REST)
        shown.append(sensor.read(REST, schedule.at(0.1 * k))["gps"])
    space = sensor.spaces["gps"]
    assert [bool(np.isnan(fix).all()) for fix in shown] == [False] * 2 + [True] * 2 + [False] * 2
    assert all(space.contains(fix) for fix in shown)
    assert not space.contains(np.array([np.nan, 1.0])) and not space.contains(np.zeros(3))
    without = fixes([REST] * 6, noise=0.5)
    assert np.array_equal(np.array(shown)[[0, 1, 4, 5]], without[[0, 1, 4, 5]])
