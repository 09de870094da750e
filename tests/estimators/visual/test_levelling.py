"""A motion seen from a tilted keyframe, against SE(3)."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from grouser.estimators.visual.levelling import levelling
from grouser.estimators.visual.motion import chassis_pose
from grouser.geometry import between, compose, project, rotation_from_rpy, transform

angles = st.floats(-0.5, 0.5)
headings = st.floats(-3.0, 3.0)
lengths = st.floats(-1.0, 1.0)


@settings(max_examples=200, deadline=None)
@given(angles, angles, headings, lengths, lengths, headings, lengths, angles, angles)
def test_levelled_motions_lead_to_where_the_pose_in_space_does(
    roll: float,
    pitch: float,
    heading: float,
    x: float,
    y: float,
    turn: float,
    height: float,
    rolled: float,
    pitched: float,
) -> None:
    T_start_keyframe = transform(rotation_from_rpy(roll, pitch, heading), [2.0, -3.0, 0.4])
    relative, added = np.array([x, y, turn]), np.empty(3)
    levelling(T_start_keyframe, relative, height, pitched, added)
    found = compose(project(T_start_keyframe), relative + added)
    space = T_start_keyframe @ chassis_pose(relative, height, rolled, pitched)
    assert np.abs(between(project(space), found)).max() < 1e-12


def test_on_level_ground_nothing_is_added() -> None:
    added = np.ones(3)
    level = transform(rotation_from_rpy(0, 0, 2.0), [1.0, 2.0, 0.0])
    levelling(level, np.array([0.3, -0.1, 1.2]), 0.0, 0.0, added)
    assert np.abs(added).max() < 1e-15


def test_a_quarter_turn_on_a_slope_is_a_degree_short() -> None:
    slope, added = transform(rotation_from_rpy(0.15, 0.15, 0.0), np.zeros(3)), np.empty(3)
    levelling(slope, np.array([0.0, 0.0, np.pi / 2]), 0.0, 0.0, added)
    assert 0.8 < abs(np.degrees(added[2])) < 1.8
