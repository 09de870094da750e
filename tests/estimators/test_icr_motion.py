"""Kinematics about instantaneous centres of rotation: exact, and differentiated rightly."""

from collections.abc import Callable

import gymnasium as gym
import numpy as np
import pytest

import grouser  # noqa: F401  (registers the environments)
from grouser.estimators.icr_motion import (
    exp_jacobian,
    icr_pose,
    icr_twist,
    icr_twist_jacobians,
    mirrored,
    mirrored_jacobian,
    on_the_spot,
    on_the_spot_slope,
)
from grouser.estimators.track_motion import arc_pose, track_increment
from grouser.geometry import Array, between, compose, exp, wrap

CENTRES = np.array([0.26, -0.32, 0.05])
COURSES = [(0.03, 0.05), (0.05, 0.03), (-0.03, -0.05), (-0.02, 0.03), (0.004, 0.04), (0.01, -0.03)]


def slope(f: Callable[[Array], Array], at: Array, h: float = 1e-6) -> Array:
    steps = h * np.eye(len(at))
    return np.stack([(f(at + step) - f(at - step)) / (2 * h) for step in steps], axis=-1)


@pytest.mark.parametrize("du", COURSES)
def test_jacobians_are_those_of_finite_differences(du: tuple[float, float]) -> None:
    tracks = np.array(du)
    by_du, by_centres = icr_twist_jacobians(tracks, CENTRES)
    assert np.abs(by_du - slope(lambda d: icr_twist(d, CENTRES), tracks)).max() < 1e-8
    assert np.abs(by_centres - slope(lambda c: icr_twist(tracks, c), CENTRES)).max() < 1e-8
    by_course = mirrored_jacobian(tracks, CENTRES)
    expected = slope(lambda d: mirrored(d) @ CENTRES, tracks, 1e-7)
    assert np.abs(by_course - expected).max() < 1e-6
    by_spot = slope(lambda d: np.array([on_the_spot(d)]), tracks, 1e-7)
    assert np.abs(on_the_spot_slope(tracks) - by_spot).max() < 1e-6


@pytest.mark.parametrize("turn", [0.0, 1e-9, 1e-3, 0.2, -2.5])
def test_the_jacobian_of_exp_is_that_of_finite_differences(turn: float) -> None:
    twist = np.array([0.4, -0.1, turn])
    assert np.abs(exp_jacobian(twist) - slope(exp, twist)).max() < 1e-8


def test_without_slip_it_is_the_arc_of_the_tracks() -> None:
    for du in np.array(COURSES):
        arc = arc_pose(*track_increment(du, 0.5))
        assert np.abs(icr_pose(du, np.array([0.25, -0.25, 0.0])) - arc).max() < 1e-15


def test_the_centres_rest_on_the_ground_while_they_move_with_their_tracks() -> None:
    for du in np.array(COURSES):
        forward, left, turn = icr_twist(du, CENTRES)
        for track, y in zip(du, CENTRES[:2], strict=True):
            velocity = [forward - turn * y, left + turn * CENTRES[2]]  # of the point of the robot
            assert np.abs(np.array([track, 0.0]) - velocity).max() < 1e-15


def test_only_turns_on_the_spot_are_wholly_so() -> None:
    assert on_the_spot(np.array([-0.03, 0.03])) == on_the_spot(np.array([0.03, -0.03])) == 1
    assert on_the_spot(np.array([0.04, 0.04])) == on_the_spot(np.array([-0.04, -0.04])) == 0
    shares = [on_the_spot(np.array([left, 0.04])) for left in (-0.03, -0.01, 0.01, 0.02, 0.03)]
    assert np.all(np.diff(shares) < 0)


def test_a_mirrored_course_has_mirrored_centres() -> None:
    left_curve, right_curve = np.array([0.03, 0.05]), np.array([0.05, 0.03])
    as_left = mirrored(left_curve) @ CENTRES
    as_right = mirrored(right_curve) @ CENTRES
    assert as_left[:2] == pytest.approx(CENTRES[:2])
    assert as_right == pytest.approx([-as_left[1], -as_left[0], as_left[2]])
    back = mirrored(-left_curve) @ CENTRES
    assert back == pytest.approx([as_left[0], as_left[1], -as_left[2]])
    assert mirrored(np.array([-0.03, 0.03])) @ CENTRES == pytest.approx([0.29, -0.29, 0.0])


@pytest.mark.parametrize("terrain", ["asphalt", "grass"])
def test_true_centres_and_track_speeds_give_the_true_drive_back(terrain: str) -> None:
    env = gym.make(
        "grouser/TrackedRobot-v0",
        world="parking-lot",
        terrain=terrain,
        difficulty=0.0,
        sensors=("tracks",),
        dynamics="fast",
    )
    try:
        _, info = env.reset(seed=0)
        rig, start, worst = env.get_wrapper_attr("rig"), info["true_pose"], 0.0
        pose = np.zeros(3)
        for step in range(60):
            action = [0.5, 0.9] if step < 30 else [-0.4, 0.6]
            _, _, _, _, info = env.step(np.array(action, np.float32))
            pose = compose(pose, icr_pose(rig.dt * info["track_speed"], info["icr"]))
            error = between(start, info["true_pose"]) - pose
            error[2] = wrap(error[2])
            worst = max(worst, float(np.abs(error).max()))
        assert worst < 2e-3  # the twist is not quite steady within a step
    finally:
        env.close()
