"""All sensors together: their keys, their timing, their memory; no effect touches another."""

from typing import Any

import numpy as np
import pytest

from grouser.envs.sensors.effects import EFFECTS, NOISES, SWITCH
from grouser.envs.sensors.schedule import Schedule
from grouser.envs.sensors.suite import SENSORS, SensorSuite, known_sensors
from grouser.envs.simulation.motion import Motion
from grouser.envs.simulation.robot import RobotModel
from grouser.envs.simulation.robot_rig import robot_rig
from grouser.envs.simulation.world import World
from grouser.envs.simulation.worlds.registry import make_world
from tests.envs.sensors.motions import drive, generators

WORLD = make_world("yard", np.random.default_rng(0))
MOTIONS = drive(WORLD, [(0.4, 0.1)] * 8)
RIG = robot_rig(RobotModel(), dt=0.1, image_size=(48, 32), amounts=Schedule().steady)
Observations = list[dict[str, Any]]


def suite(keys: tuple[str, ...] = SENSORS, **options: Any) -> SensorSuite:
    return SensorSuite(RIG, keys, fastest_track=1.0, **options)


def observed(
    sensors: SensorSuite,
    schedule: Schedule,
    *,
    noise_scale: float = 1.0,
    seed: int = 0,
    world: World = WORLD,
) -> Observations:
    sensors.enter(world, generators(seed), noise_scale=noise_scale)
    return go_on(sensors, schedule, MOTIONS)


def go_on(
    sensors: SensorSuite, schedule: Schedule, motions: list[Motion], first: int = 0
) -> Observations:
    return [
        sensors.observe(motion, 0.1 * k, schedule.at(0.1 * k))
        for k, motion in enumerate(motions, first)
    ]


def same(ones: Observations, others: Observations, keys: tuple[str, ...]) -> bool:
    return all(
        np.array_equal(one[key], other[key], equal_nan=one[key].dtype.kind == "f")
        for one, other in zip(ones, others, strict=True)
        for key in keys
    )


def test_an_observation_has_the_keys_of_its_space() -> None:
    sensors = suite(timing={"stereo.rate": 5.0, "gps.latency": 0.3})
    for observation in observed(sensors, Schedule()):
        assert sensors.space.contains(observation)
    extra = {"left_stamp", "right_stamp", "gps_stamp"}
    assert set(sensors.space.spaces) == {*SENSORS, "stamp"} | extra
    sensors.close()


def test_eyes_may_look_at_different_times() -> None:
    sensors = suite(("left", "right"), timing={"right.rate": 5.0})
    both = suite(("left", "right"))
    one, other = observed(sensors, Schedule()), observed(both, Schedule())
    assert same(one, other, ("left",)) and "left_stamp" not in one[0]
    assert np.array_equal(one[3]["right"], one[2]["right"])
    assert np.array_equal(one[0]["right"], other[0]["right"])
    sensors.close()
    both.close()


def test_leaving_a_sensor_out_changes_no_bit_of_the_others() -> None:
    schedule = Schedule({"stereo.frozen": 0.5, "stereo.exposure_drift": 0.2, "lidar.dropout": 0.2})
    everything = observed(suite(), schedule)
    for keys in (("right",), ("left",), ("lidar", "gps"), ("tracks", "imu")):
        assert same(observed(suite(keys), schedule), everything, keys)


def amount_of(name: str) -> float:
    """One that shows."""
    effect = EFFECTS[name]
    return 1.0 if effect.unit == SWITCH or effect.most == 1 else effect.most / 2


TOUCHED = {"stereo": ("left", "right"), "left": ("left",), "right": ("right",)}


ELSEWHERE = ("left_track", "right_track")
"""Effects of the tracks themselves, which the environment passes to the physics."""
OUT_OF_VIEW = "glare"
"""The sun's, which tests/envs/sensors/test_stereo.py looks into."""
SHOWN = [
    name
    for name in EFFECTS
    if name.partition(".")[0] not in ELSEWHERE and name.partition(".")[2] != OUT_OF_VIEW
]


@pytest.mark.parametrize("name", SHOWN)
def test_an_effect_shows_on_its_own_sensor_and_on_no_other(name: str) -> None:
    """And what it is on changes nothing before it begins."""
    group = name.partition(".")[0]
    touched = TOUCHED.get(group, (group,))
    fault = {"what": name, "start": 0.4, "amount": amount_of(name)}
    keys = SENSORS if group in TOUCHED else tuple(k for k in SENSORS if k not in ("left", "right"))
    without = observed(suite(keys), Schedule())
    faulty = observed(suite(keys), Schedule(faults=[fault]))
    assert same(faulty[:4], without[:4], keys)
    assert same(faulty, without, tuple(key for key in keys if key not in touched))
    changed = [key for key in touched if not same(faulty, without, (key,))]
    assert changed


def test_amounts_of_zero_are_as_if_the_effect_were_absent() -> None:
    zero = {name: 0.0 for name, effect in EFFECTS.items() if effect.default == 0}
    assert same(observed(suite(), Schedule(zero)), observed(suite(), Schedule()), SENSORS)


def test_after_a_fault_everything_is_as_if_it_had_not_been() -> None:
    """Of sensors that remember nothing of it: their noise goes on as it would have."""
    faults = [
        {"what": what, "start": 0.2, "end": 0.5, "amount": 1.0}
        for what in ("stereo.darkness", "lidar.dropout", "gps.outage", "imu.dead", "stereo.dropped")
    ]
    faulty, well = observed(suite(), Schedule(faults=faults)), observed(suite(), Schedule())
    assert same(faulty[:2], well[:2], SENSORS) and same(faulty[5:], well[5:], SENSORS)
    for key in ("left", "lidar", "gps", "imu"):
        assert not same(faulty[2:3], well[2:3], (key,))


def test_noise_is_scaled_all_at_once_and_the_truth_is_not() -> None:
    schedule = Schedule({name: 0.0 for name in NOISES})
    quiet, doubled, plain = (
        observed(suite(), schedule, noise_scale=2.0),
        observed(suite(), Schedule(), noise_scale=2.0),
        observed(suite(), Schedule()),
    )
    assert same(quiet, observed(suite(), schedule), SENSORS)
    for k in range(len(plain)):
        error = plain[k]["imu"] - quiet[k]["imu"]
        np.testing.assert_allclose(doubled[k]["imu"] - quiet[k]["imu"], 2 * error, atol=1e-12)


EVERYTHING: dict[str, float] = {
    name: amount_of(name) / 4 if effect.most > 1 or effect.unit != SWITCH else 0.0
    for name, effect in EFFECTS.items()
    if effect.follows is None
}
TIMING = {"lidar.rate": 5.0, "gps.latency": 0.3, "stereo.latency": 0.1, "tracks.rate": 2.0}


def test_a_saved_suite_goes_on_to_the_bit() -> None:
    """Also a fresh one, and one that was in another world meanwhile."""
    schedule = Schedule(EVERYTHING)
    sensors = suite(timing=TIMING)
    sensors.enter(WORLD, generators(0), noise_scale=1.5)
    go_on(sensors, schedule, MOTIONS[:5])
    saved = sensors.save()
    keys = tuple(sensors.space.spaces)
    then = go_on(sensors, schedule, MOTIONS[5:], 5)
    sensors.restore(saved, WORLD)
    assert same(go_on(sensors, schedule, MOTIONS[5:], 5), then, keys)
    sensors.enter(make_world("yard", np.random.default_rng(1)), generators(1))
    sensors.restore(saved, WORLD)
    assert same(go_on(sensors, schedule, MOTIONS[5:], 5), then, keys)
    fresh = suite(timing=TIMING)
    fresh.restore(saved, WORLD)
    assert same(go_on(fresh, schedule, MOTIONS[5:], 5), then, keys)
    sensors.close()
    fresh.close()


def test_the_left_eyes_depth_is_that_of_what_it_sees() -> None:
    sensors = suite(())
    depth = sensors.depth(WORLD, MOTIONS[0])
    seen = sensors.segmentation(WORLD, MOTIONS[0])
    assert depth.shape == seen.shape == (32, 48)
    assert np.array_equal(np.isinf(depth), seen == 0) and (seen == 1).any()
    sensors.close()
    sensors.close()


def test_unknown_sensors_are_refused() -> None:
    assert known_sensors(["gps", "left", "stamp"]) == ("left", "gps")
    with pytest.raises(ValueError, match="no sensor is named 'sonar'; known: left, .*gps"):
        known_sensors(("sonar",))
    with pytest.raises(ValueError, match="lidar.rate of 3 Hz"):
        suite(timing={"lidar.rate": 3.0})
