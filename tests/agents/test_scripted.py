"""Scripted drives go where their names say, at moderate speed, and touch nothing."""

import gymnasium as gym
import numpy as np
import pytest

import grouser  # noqa: F401  (registers the environments)
from grouser.agents.scripted import DRIVES, TOP_SPEED, Drive, track_action
from grouser.geometry import Array, compose, exp
from grouser.rig import Rig, TrackGeometry

RIG = Rig(dt=0.1, tracks=TrackGeometry(gauge=0.4, width=0.08, effective_width=0.55))
STEPS = 600
EVERY = pytest.mark.parametrize("name", DRIVES)


def ideal_course(drive: Drive, steps: int = STEPS) -> Array:
    """(steps + 1, 3) of a robot that does as it is told and slips as usual."""
    poses = [np.zeros(3)]
    for step in range(steps):
        left, right = drive(step) * TOP_SPEED * RIG.dt
        poses.append(compose(poses[-1], exp([(left + right) / 2, 0.0, (right - left) / 0.55])))
    return np.array(poses)


@EVERY
def test_actions_are_moderate_and_the_same_every_time(name: str) -> None:
    drive, again = DRIVES[name](RIG), DRIVES[name](RIG)
    actions = np.array([drive(step) for step in range(STEPS)])
    assert actions.shape == (STEPS, 2)
    assert np.abs(actions).max() <= 0.99
    np.testing.assert_array_equal(actions, [again(step) for step in range(STEPS)])
    speed = actions.mean(axis=1) * TOP_SPEED
    rate = np.diff(actions, axis=1)[:, 0] * TOP_SPEED / 0.55
    assert np.abs(speed).max() <= 0.4
    assert np.abs(rate).max() <= 0.6


def test_straight_goes_three_metres_out_and_comes_back() -> None:
    course = ideal_course(DRIVES["straight"](RIG), steps=4 * 86)
    assert course[:, 0].max() == pytest.approx(3.0, abs=0.05)
    assert np.abs(course[:, 1:]).max() < 1e-9
    assert course[-1, 0] == pytest.approx(0, abs=1e-9)


def test_spot_turn_turns_once_around_each_way_on_the_spot() -> None:
    drive = DRIVES["spot-turn"](RIG)
    around = next(step for step in range(STEPS) if drive(step)[1] < 0)
    course = ideal_course(drive, steps=2 * around)
    assert np.abs(course[:, :2]).max() < 1e-9
    turned = np.unwrap(course[:, 2])
    assert turned.max() == pytest.approx(2 * np.pi, abs=0.05)
    assert turned[-1] == pytest.approx(0, abs=1e-9)


def test_figure_eight_circles_both_ways_and_drives_twenty_metres() -> None:
    course = ideal_course(DRIVES["figure-eight"](RIG))
    assert course[:, 1].max() > 1.5 and course[:, 1].min() < -1.5
    assert np.linalg.norm(course[:, :2], axis=1).max() < 2.0
    assert np.linalg.norm(np.diff(course[:, :2], axis=0), axis=1).sum() > 20


@EVERY
def test_the_simulated_robot_stays_in_the_clear(name: str) -> None:
    env = gym.make("grouser/TrackedRobot-v0", world="yard", sensors=())
    _, info = env.reset(seed=0)
    drive = DRIVES[name](env.get_wrapper_attr("rig"))
    farthest = 0.0
    for step in range(STEPS):
        *_, info = env.step(drive(step).astype(np.float32))
        assert not info["collision"], f"hit something in step {step} at {info['true_pose']}"
        farthest = max(farthest, float(np.linalg.norm(info["true_pose"][:2])))
    env.close()
    assert farthest < 3.3


def test_an_action_is_the_speeds_of_the_tracks() -> None:
    left, right = track_action(RIG, 0.3, 0.4, top_speed=0.5) * 0.5
    assert (left + right) / 2 == pytest.approx(0.3)
    assert (right - left) / 0.55 == pytest.approx(0.4)


def test_too_much_speed_keeps_the_curve() -> None:
    left, right = track_action(RIG, 3.0, 4.0, top_speed=0.5)
    assert max(abs(left), abs(right)) == pytest.approx(1.0)
    slow_left, slow_right = track_action(RIG, 0.3, 0.4, top_speed=0.5)
    assert left / right == pytest.approx(slow_left / slow_right)


def test_without_tracks_there_is_no_driving() -> None:
    with pytest.raises(ValueError, match=r"a robot needs tracks; this rig has none"):
        track_action(Rig(dt=0.1), 0.3, 0.0, top_speed=0.5)
