"""Courses are those of the paper, and the robot strikes nothing on them."""

from dataclasses import replace

import numpy as np
import pytest

from grouser.scripts.reproduction.zhao import course as course_module
from grouser.scripts.reproduction.zhao.course import Course, plan
from grouser.scripts.reproduction.zhao.course_experiment import (
    CourseExperiment,
    Subject,
    subjects,
    without_offset,
)
from grouser.scripts.reproduction.zhao.courses import (
    free_indoors,
    free_outdoors,
    linear_indoors,
    linear_outdoors,
    spot_turns,
)
from grouser.scripts.reproduction.zhao.manoeuvres import SpotTurn, ThereAndBack, Tour
from grouser.scripts.reproduction.zhao.scale import FULL


def test_sets_and_frames_are_the_papers() -> None:
    assert [c.frames for c in linear_indoors(FULL)] == [400] * 5
    assert [c.frames for c in linear_outdoors(FULL)] == [1200] * 5
    assert [(c.terrain, c.frames) for c in spot_turns(FULL)] == [
        ("asphalt", 1800),
        ("cement", 2400),
    ]
    assert [c.frames for c in free_outdoors(FULL)] == [1403, 2419, 2670]
    names = [c.name for kind in (linear_indoors, free_indoors) for c in kind(FULL)]
    assert len(names) == len(set(names))


def test_a_course_goes_out_and_back() -> None:
    course = Course("there", "yard", ThereAndBack(0.2), frames=100)
    outcome = CourseExperiment(course, subjects(("dead-reckoning",))).run(lambda: None)
    x = outcome["true_pose"][:, 0]
    assert x.max() == pytest.approx(1.0, abs=0.05) and abs(x[-1]) < 0.05
    assert outcome["dead-reckoning.pose"].shape == (101, 3)
    assert outcome["twist"].shape == outcome["icr"].shape == (100, 3)


def test_the_same_course_is_the_same_bits() -> None:
    course = Course("turn", "yard", SpotTurn(0.1), frames=10)
    experiment = CourseExperiment(course, subjects(("one-point-ransac",)))
    one, other = experiment.run(lambda: None), experiment.run(lambda: None)
    assert one.keys() == other.keys()
    for key in one.keys() - {"one-point-ransac.ms"}:
        np.testing.assert_array_equal(one[key], other[key], err_msg=key)


def test_a_tour_outlasts_the_worlds_goals() -> None:
    planned = plan(Course("tour", "room", Tour(), frames=900))
    assert planned.actions.shape == (900, 2) and np.abs(planned.actions).max() <= 1


def test_a_course_that_strikes_something_is_driven_elsewhere_or_refused(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    too_long = Course("long", "room", ThereAndBack(0.5), frames=600)
    monkeypatch.setattr(course_module, "_TRIES", 2)
    with pytest.raises(RuntimeError, match="'long' strikes something in each of 2 worlds 'room'"):
        plan(too_long)
    assert plan(replace(too_long, frames=20)).seed == 0


def test_ignoring_the_offset_moves_the_camera_over_the_track_centre_alone() -> None:
    rig = Course("any", "yard", SpotTurn(1.0), frames=1).make(()).rig
    assert rig.stereo is not None
    ignorant = without_offset(rig)
    assert ignorant.stereo is not None
    expected = rig.stereo.T_base_camera.copy()
    expected[:2, 3] = 0
    np.testing.assert_array_equal(ignorant.stereo.T_base_camera, expected)
    assert Subject("x", "one-point-ransac", ignores_offset=True).make(rig) is not None
