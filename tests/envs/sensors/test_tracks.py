"""Track encoders measure the tracks, with the stated noise and without losing counts."""

import numpy as np
import pytest

from grouser.envs.sensors.tracks import TrackEncoders
from grouser.envs.simulation.worlds.registry import make_world
from grouser.geometry import Array
from tests.envs.sensors.motions import at_rest, generators

WORLD = make_world("yard", np.random.default_rng(0))


def increments(
    n: int, travel: tuple[float, float], *, noise: float = 0.0, resolution: float = 1e-4
) -> Array:
    sensor = TrackEncoders(limit=0.1, noise=noise, resolution=resolution)
    sensor.enter(WORLD, generators(3))
    return np.array([sensor.read(at_rest(np.eye(4), travel))["tracks"] for _ in range(n)])


def test_they_measure_the_track_and_not_the_body() -> None:
    """The body rests: a robot whose tracks spin in place."""
    np.testing.assert_allclose(increments(1, (0.03, -0.02))[0], [0.03, -0.02], atol=1e-4)


def test_counts_are_whole_and_none_is_lost() -> None:
    travel = (0.012345, -0.00321)
    measured = increments(200, travel)
    counts = measured / 1e-4
    np.testing.assert_allclose(counts, np.round(counts), atol=1e-6)
    np.testing.assert_allclose(measured.sum(axis=0), 200 * np.array(travel), atol=1e-4)


def test_noise_is_a_fraction_of_the_increment() -> None:
    measured = increments(4000, (0.04, -0.01), noise=0.02, resolution=1e-6)
    np.testing.assert_allclose(measured.std(axis=0), [0.02 * 0.04, 0.02 * 0.01], rtol=0.05)
    left, right = measured.T - measured.mean(axis=0)[:, None]
    power = np.mean(left**2)
    assert abs(np.mean(left * right)) < 0.05 * power  # each track its own
    assert abs(np.mean(left[1:] * left[:-1])) < 0.05 * power  # white
    assert np.all(increments(10, (0.0, 0.0), noise=0.02) == 0)  # none at rest


def test_increments_stay_within_the_space() -> None:
    assert increments(1, (5.0, -5.0)) == pytest.approx(np.array([[0.1, -0.1]]))
