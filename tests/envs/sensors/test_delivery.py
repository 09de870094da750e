"""Rates and latencies: what is shown when, nothing twice, and all of it can be saved."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from grouser.envs.sensors.delivery import Delivered, Timing, timing_of
from grouser.envs.sensors.gps import SatelliteReceiver
from grouser.envs.sensors.imu import InertialUnit
from grouser.envs.sensors.tracks import TrackEncoders
from grouser.envs.simulation.worlds.registry import make_world
from grouser.geometry import lift
from tests.envs.sensors.motions import at_rest, drive, generators, quiet, readings

WORLD = make_world("yard", np.random.default_rng(0))


def test_without_a_timing_a_sensor_is_read_at_every_step_and_seen_at_once() -> None:
    assert timing_of("lidar", {}, 0.1) == Timing(1, 0)
    assert timing_of("lidar", {"gps.rate": 1.0}, 0.1) == Timing(1, 0)


def test_an_eye_follows_the_pair_unless_it_has_a_timing_of_its_own() -> None:
    timing = {"stereo.rate": 5.0, "stereo.latency": 0.1, "right.rate": 2.0}
    assert timing_of("left", timing, 0.1) == Timing(2, 1)
    assert timing_of("right", timing, 0.1) == Timing(5, 1)


@pytest.mark.parametrize(
    ("latency", "steps"), [(0.0, 0), (0.01, 1), (0.1, 1), (0.3, 3), (0.31, 4), (0.7, 7)]
)
def test_a_reading_is_seen_by_the_first_observation_after_its_latency(
    latency: float, steps: int
) -> None:
    assert timing_of("gps", {"gps.latency": latency}, 0.1).delay == steps


@pytest.mark.parametrize(
    ("timing", "words"),
    [
        (
            {"lidar.rate": 3.0},
            "lidar.rate of 3 Hz is every 0.333333 s, which is no whole ",
        ),
        ({"lidar.rate": 3.0}, "control step of 0.1 s; the nearest that is: 3.33333 Hz"),
        ({"lidar.rate": 40.0}, "the nearest that is: 10 Hz"),
        ({"lidar.rate": 0}, "lidar.rate must be a positive number of Hz, got 0"),
        ({"imu.rate": "often"}, "imu.rate must be a positive number of Hz, got 'often'"),
        ({"gps.latency": -0.1}, "gps.latency must be 0 s or more, got -0.1"),
        ({"gps.delay": 0.1}, "no timing is named 'gps.delay'; .*gps has: gps.rate, gps.latency"),
        ({"ldar.rate": 5.0}, r"no timing is named 'ldar.rate'; did you mean 'lidar.rate'\?"),
    ],
)
def test_a_timing_that_cannot_be_is_refused(timing: dict[str, Any], words: str) -> None:
    with pytest.raises(ValueError, match=words):
        for key in ("lidar", "imu", "gps"):
            timing_of(key, timing, 0.1)


def along_x(n: int) -> list[Any]:
    """A robot that is a metre further at every step."""
    return [at_rest(lift([float(k), 0.0, 0.0])) for k in range(n)]


@given(period=st.integers(1, 5), delay=st.integers(0, 7))
@settings(deadline=None)
def test_what_is_shown_is_what_was_measured_when_the_stamp_says(period: int, delay: int) -> None:
    """And that is the newest that could have come by then."""
    sensor = Delivered(SatelliteReceiver(dt=0.1), Timing(period, delay), dt=0.1)
    shown = readings(sensor, WORLD, along_x(25), quiet())
    for k, reading in enumerate(shown):
        measured = max(k - delay, 0) // period * period
        assert reading["gps_stamp"][0] == measured * 0.1
        assert reading["gps"][0] == pytest.approx(measured, abs=1e-9)
        assert sensor.spaces["gps_stamp"].contains(reading["gps_stamp"])


@given(
    travels=st.lists(st.floats(-0.05, 0.05), min_size=1, max_size=40),
    period=st.integers(1, 4),
    delay=st.integers(0, 3),
)
@settings(deadline=None)
def test_increments_add_up_to_the_travel(travels: Sequence[float], period: int, delay: int) -> None:
    """None is shown twice, and none is lost but what is still on its way."""
    encoders = TrackEncoders(limit=0.4)
    sensor = Delivered(encoders, Timing(period, delay), dt=0.1)
    motions = [at_rest(np.eye(4)), *(at_rest(np.eye(4), (x, -x)) for x in travels)]
    shown = readings(sensor, WORLD, motions, quiet())
    total = np.zeros(2)
    for k, reading in enumerate(shown):
        total += reading["tracks"]
        arrived = sum(travels[: round(reading["tracks_stamp"][0] / 0.1)])
        np.testing.assert_allclose(total, [arrived, -arrived], atol=1.1e-4)
        assert reading["tracks_stamp"][0] == max(k - delay, 0) // period * period * 0.1


def test_a_slow_imu_shows_means_until_the_next() -> None:
    motions = drive(WORLD, [(0.4, 0.2)] * 9)
    each = [r["imu"] for r in readings(InertialUnit(dt=0.1), WORLD, motions, quiet())]
    slow = Delivered(InertialUnit(dt=0.1), Timing(3, 0), dt=0.1)
    shown = [r["imu"] for r in readings(slow, WORLD, motions, quiet())]
    for k in (3, 6, 9):
        np.testing.assert_allclose(shown[k], np.mean(each[k - 2 : k + 1], axis=0))
    assert np.array_equal(shown[4], shown[3]) and np.array_equal(shown[5], shown[3])


def test_readings_that_are_shown_again_share_no_memory() -> None:
    sensor = Delivered(SatelliteReceiver(dt=0.1), Timing(4, 0), dt=0.1)
    shown = readings(sensor, WORLD, along_x(4), quiet())
    for one, other in zip(shown, shown[1:], strict=False):
        assert not any(np.may_share_memory(one[key], other[key]) for key in one)
    shown[1]["gps"][:] = np.nan  # and what a reader does to its own changes no other's
    assert np.isfinite(shown[2]["gps"]).all()


def test_what_is_on_its_way_is_saved_too() -> None:
    motions = along_x(20)

    def rest(sensor: Delivered, amounts: Mapping[str, float]) -> list[float]:
        shown = []
        for motion in motions[10:]:
            sensor.advance(motion)
            shown.append(sensor.read(motion, amounts)["gps"].tolist())
        return shown

    noisy = quiet({"gps.noise": 1.0, "gps.drift": 2.0})
    sensor = Delivered(SatelliteReceiver(dt=0.1), Timing(2, 5), dt=0.1)
    readings(sensor, WORLD, motions[:10], noisy)
    saved = sensor.save()
    once = rest(sensor, noisy)
    sensor.restore(saved)
    assert rest(sensor, noisy) == once
    fresh = Delivered(SatelliteReceiver(dt=0.1), Timing(2, 5), dt=0.1)
    fresh.enter(WORLD, generators(9))
    fresh.restore(saved)
    assert rest(fresh, noisy) == once
