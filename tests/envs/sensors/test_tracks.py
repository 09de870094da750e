"""Track encoders measure the tracks, with the stated noise and without losing counts."""

import numpy as np
import pytest

from grouser.envs.sensors.schedule import Schedule
from grouser.envs.sensors.tracks import TrackEncoders
from grouser.envs.simulation.worlds.registry import make_world
from grouser.geometry import Array
from tests.envs.sensors.motions import at_rest, generators, quiet, readings

WORLD = make_world("yard", np.random.default_rng(0))


def increments(n: int, travel: tuple[float, float], **effects: float) -> Array:
    amounts = quiet({f"tracks.{name}": amount for name, amount in effects.items()})
    motions = [at_rest(np.eye(4), travel)] * n
    read = readings(TrackEncoders(limit=0.1), WORLD, motions, amounts, seed=3)
    return np.array([reading["tracks"] for reading in read])


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


def test_the_share_of_missed_ticks_is_the_one_stated() -> None:
    """And they are whole ticks, missed whichever way the track runs."""
    measured = increments(500, (0.02, -0.02), missed_ticks=0.3)
    np.testing.assert_allclose(measured.mean(axis=0), [0.7 * 0.02, -0.7 * 0.02], rtol=0.01)
    np.testing.assert_allclose(measured / 1e-4, np.round(measured / 1e-4), atol=1e-6)
    assert np.all(increments(3, (0.02, 0.02), missed_ticks=1.0) == 0)


def test_a_wrong_scale_is_that_of_its_track_alone() -> None:
    total = increments(100, (0.02, 0.02), left_scale=0.05, right_scale=-0.1).sum(axis=0)
    np.testing.assert_allclose(total, [1.05 * 2.0, 0.9 * 2.0], atol=1e-4)


def test_a_stuck_encoder_reads_nothing_while_it_is_stuck() -> None:
    """And does not make up for it when it comes loose; the other one is not touched."""
    schedule = Schedule(faults=[{"what": "tracks.left_stuck", "start": 0.2, "end": 0.5}])
    shown = {}
    for name, faulty in (("stuck", True), ("well", False)):
        sensor = TrackEncoders(limit=0.1)
        sensor.enter(WORLD, generators(0))
        rows = []
        for k in range(8):
            motion = at_rest(np.eye(4), (0.02, 0.01))
            sensor.advance(motion)
            rows.append(sensor.read(motion, schedule.at(0.1 * k if faulty else 0.0))["tracks"])
        shown[name] = np.array(rows)
    stuck, well = shown["stuck"], shown["well"]
    assert np.all(stuck[2:5, 0] == 0) and np.all(stuck[[0, 1, 5, 6, 7], 0] > 0)
    np.testing.assert_allclose(stuck[5:, 0], well[5:, 0], atol=1.1e-4)
    assert np.array_equal(stuck[:, 1], well[:, 1])


def test_a_coarser_encoder_loses_nothing_when_a_fault_makes_it_coarse() -> None:
    schedule = Schedule(faults=[{"what": "tracks.resolution", "start": 0.5, "amount": 0.01}])
    sensor = TrackEncoders(limit=0.1)
    sensor.enter(WORLD, generators(0))
    motion, total = at_rest(np.eye(4), (0.013, 0.013)), 0.0
    for k in range(100):
        sensor.advance(motion)
        quiet_amounts = dict(schedule.at(0.1 * k)) | {"tracks.noise": 0.0}
        total += sensor.read(motion, quiet_amounts)["tracks"][0]
    assert total == pytest.approx(1.3, abs=0.011)
