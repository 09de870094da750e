"""A fault begins and ends when it says, and costs nothing in between."""

import json
from dataclasses import asdict
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from grouser.envs.sensors.effects import EFFECTS
from grouser.envs.sensors.schedule import Fault, Schedule


def test_without_anything_every_effect_has_its_default() -> None:
    schedule = Schedule()
    expected = {name: effect.default for name, effect in EFFECTS.items()}
    assert schedule.at(0.0) == schedule.at(1e6) == schedule.steady == expected


def test_what_is_said_of_both_eyes_holds_for_each_unless_it_has_its_own() -> None:
    amounts = Schedule({"stereo.defocus": 2.0, "left.defocus": 0.5}).at(0.0)
    assert amounts["left.defocus"] == 0.5 and amounts["right.defocus"] == 2.0


@given(start=st.integers(0, 50), length=st.integers(1, 50), dt=st.sampled_from([0.1, 0.05, 1 / 30]))
def test_a_fault_begins_and_ends_when_it_says(start: int, length: int, dt: float) -> None:
    """To the step, though times of steps are rounded."""
    fault = {"what": "lidar.dropout", "start": start * dt, "end": (start + length) * dt}
    schedule = Schedule({"lidar.dropout": 0.25}, [fault])
    steps = range(110)
    shown = [schedule.at(k * dt)["lidar.dropout"] for k in steps]
    assert shown == [1.0 if start <= k < start + length else 0.25 for k in steps]
    assert schedule.steady["lidar.dropout"] == 0.25


def test_without_an_end_it_holds_for_ever() -> None:
    schedule = Schedule(faults=[{"what": "imu.dead", "start": 2.0}])
    assert [schedule.at(t)["imu.dead"] for t in (1.9, 2.0, 1e8)] == [0.0, 1.0, 1.0]


def test_of_several_faults_of_one_effect_the_last_holds() -> None:
    faults = [
        {"what": "stereo.darkness", "start": 0.0, "end": 3.0, "amount": 0.2},
        {"what": "stereo.darkness", "start": 1.0, "end": 2.0, "amount": 0.9},
    ]
    schedule = Schedule(faults=faults)
    assert [schedule.at(t)["left.darkness"] for t in (0.5, 1.5, 2.5, 3.5)] == [0.2, 0.9, 0.2, 0.0]


def test_time_may_be_asked_for_in_any_order() -> None:
    schedule = Schedule(faults=[{"what": "gps.outage", "start": 1.0, "end": 2.0}])
    assert [schedule.at(t)["gps.outage"] for t in (5.0, 1.5, 0.0, 1.5)] == [0.0, 1.0, 0.0, 1.0]


def test_nothing_is_worked_out_again_until_something_changes() -> None:
    schedule = Schedule(faults=[{"what": "gps.outage", "start": 1.0, "end": 2.0}])
    assert schedule.at(1.0) is schedule.at(1.9) is not schedule.at(2.0)
    assert schedule.at(1.1) is schedule.at(1.2)


def test_amounts_cannot_be_changed_by_who_reads_them() -> None:
    with pytest.raises(TypeError):
        Schedule().at(0.0)["imu.dead"] = 1.0  # type: ignore[index]


def test_faults_survive_json() -> None:
    given_ones: list[dict[str, Any]] = [
        {"what": "stereo.darkness", "start": 5.0, "end": 8.0, "amount": 0.9},
        {"what": "left_track.power_loss"},
    ]
    back = json.loads(json.dumps(given_ones))
    assert Schedule(faults=back).faults == Schedule(faults=given_ones).faults
    again = json.loads(json.dumps([asdict(fault) for fault in Schedule(faults=back).faults]))
    assert Schedule(faults=again).faults == Schedule(faults=back).faults
    assert Schedule(faults=[Fault("left_track.power_loss")]).faults[0].amount == 1.0


@pytest.mark.parametrize(
    ("fault", "words"),
    [
        ({"what": "lidar.droput"}, "did you mean 'lidar.dropout'"),
        ({"start": 1.0}, "a fault needs 'what', the name of an effect, got {'start': 1.0}"),
        ("lidar.dropout", "a fault needs 'what'"),
        ({"what": "imu.dead", "begin": 1}, "no 'begin'; it has: what, start, end, amount"),
        ({"what": "imu.dead", "start": 5, "end": 2}, "must end after it starts, at 5 s, got end 2"),
        ({"what": "imu.dead", "start": -1}, "the start of a fault of imu.dead must be 0 s or more"),
        ({"what": "imu.dead", "end": "soon"}, "the end of a fault of imu.dead must be 0 s or more"),
        ({"what": "imu.dead", "amount": 2}, "imu.dead .* got 2"),
    ],
)
def test_a_malformed_fault_is_refused(fault: Any, words: str) -> None:
    with pytest.raises(ValueError, match=words):
        Schedule(faults=[fault])


def test_an_unknown_effect_is_refused() -> None:
    with pytest.raises(ValueError, match="no effect is named 'stereo.sharpness'"):
        Schedule({"stereo.sharpness": 1.0})
