"""The filter of several poses at once agrees with least squares, and forgets nothing."""

import numpy as np
import pytest

from grouser.estimators.joint_state import BIASES_FROM, KEYFRAME, MARK, POSE, JointState
from grouser.estimators.visual.constant_errors import ConstantErrors, disparity_offset
from grouser.estimators.visual.fusion import Accumulated, RelativeFilter, RelativePose, nothing_yet
from grouser.estimators.visual.prediction import Increment
from grouser.geometry import Array, between, compose

SIGMAS = np.array([0.05, 0.05, 0.1, 0.02])
"""Of three scale errors and the disparity offset."""


def increment(rng: np.random.Generator) -> Increment:
    A = rng.normal(size=(3, 3)) * 0.002
    pose = np.array([0.05, 0.002, 0.03]) + 0.01 * rng.normal(size=3)
    return Increment(pose, A @ A.T + 1e-8 * np.eye(3), 0.05 * rng.normal(size=(3, 3)))


def moved(rng: np.random.Generator, steps: int = 6) -> JointState:
    state = JointState.at_start(SIGMAS)
    for _ in range(steps):
        state = state.then(increment(rng))
    return state


def test_with_relative_poses_alone_it_is_the_filter_of_visual_odometry() -> None:
    rng = np.random.default_rng(0)
    errors = ConstantErrors(("one", "two", "three"), SIGMAS[:3], np.zeros(3))
    older = RelativeFilter(errors, disparity_sigma=0.02)
    state = JointState.at_start(SIGMAS)
    for _ in range(5):
        predicted: Accumulated = nothing_yet(errors)
        for _ in range(4):
            step = increment(rng)
            predicted, state = predicted.then(step), state.then(step)
        R, by_disparity = np.diag([1e-6, 2e-6, 1e-7]), 0.01 * rng.normal(size=3)
        seen = RelativePose(predicted.pose + 1e-3 * rng.normal(size=3), R, by_disparity)
        fused = older.fuse(predicted, seen)
        by_biases = np.column_stack([np.zeros((3, 3)), by_disparity])
        measurement = state.sees_relative(seen.pose, R, by_biases)
        assert state.nis(measurement) == pytest.approx(fused.nis)
        wandered = np.sqrt(4) * np.append(np.zeros(3), disparity_offset(0.02).walks)
        state = state.corrected(measurement).with_keyframe().wandered(wandered)
        older.commit(fused)
        assert np.abs(state.pose - fused.state.pose).max() < 1e-12
        assert np.abs(state.biases - fused.state.biases).max() < 1e-12
        part = np.r_[POSE, BIASES_FROM : BIASES_FROM + 4]
        assert np.abs(state.covariance[np.ix_(part, part)] - fused.state.covariance).max() < 1e-12


@pytest.mark.parametrize("what", ["relative", "turn", "position"])
def test_the_derivative_of_what_is_expected_is_that_of_finite_differences(what: str) -> None:
    rng = np.random.default_rng(1)
    state = moved(rng).with_mark().then(increment(rng))
    by_biases = rng.normal(size=(3, 4))

    def expected(change: Array) -> Array:
        there = JointState(
            state.pose + change[POSE],
            state.keyframe + change[KEYFRAME],
            state.mark + change[MARK],
            state.biases + change[BIASES_FROM:],
            state.covariance,
            state.white,
        )
        if what == "relative":
            return -there.sees_relative(np.zeros(3), np.eye(3), by_biases).innovation
        if what == "turn":
            return -there.sees_turn(0.0, 1.0, by_biases[0]).innovation
        return -there.sees_position(np.zeros(2), 1.0).innovation

    if what == "relative":
        H = state.sees_relative(np.zeros(3), np.eye(3), by_biases).by_state
    elif what == "turn":
        H = state.sees_turn(0.0, 1.0, by_biases[0]).by_state
    else:
        H = state.sees_position(np.zeros(2), 1.0).by_state
    steps = 1e-6 * np.eye(len(state.covariance))
    numeric = np.stack([(expected(s) - expected(-s)) / 2e-6 for s in steps], axis=-1)
    assert np.abs(H - numeric).max() < 1e-8


def test_independent_measurements_may_come_in_any_order() -> None:
    state = moved(np.random.default_rng(2))
    fix = state.sees_position(state.pose[:2], 0.01)
    turn = state.sees_turn(float(state.pose[2]), 1e-6, np.zeros(4))
    one, other = state.corrected(fix).corrected(turn), state.corrected(turn).corrected(fix)
    assert np.abs(one.covariance - other.covariance).max() < 1e-14


def test_a_fix_now_corrects_the_keyframe_too_and_not_what_lies_between() -> None:
    state = moved(np.random.default_rng(3)).with_keyframe()
    fix = state.pose[:2] + [0.02, -0.01]
    after = state.corrected(state.sees_position(fix, 1e-3))
    assert np.abs(after.relative).max() < 1e-12  # still the same pose
    assert np.abs(after.pose[:2] - fix).max() < 1e-3
    later = after.then(increment(np.random.default_rng(4)))
    assert np.abs(between(later.keyframe, later.pose) - later.relative).max() == 0


def test_the_covariance_is_that_of_samples() -> None:
    rng = np.random.default_rng(5)
    steps = [increment(rng) for _ in range(5)]
    state = JointState.at_start(SIGMAS)
    for step in steps:
        state = state.then(step)
    ends = []
    for _ in range(4000):
        biases, pose = SIGMAS * rng.normal(size=4), np.zeros(3)
        for step in steps:
            noise = rng.multivariate_normal(np.zeros(3), step.covariance)
            pose = compose(pose, step.pose + step.by_biases @ biases[:3] + noise)
        ends.append(np.concatenate([pose, biases]))
    part = np.r_[POSE, BIASES_FROM : BIASES_FROM + 4]
    sampled, said = np.cov(np.array(ends).T), state.covariance[np.ix_(part, part)]
    scale = np.sqrt(np.outer(np.diag(said), np.diag(said)))
    assert np.abs((sampled - said) / scale).max() < 0.08


def test_doubt_adds_the_white_noise_since_the_keyframe_and_no_more() -> None:
    rng = np.random.default_rng(6)
    state = moved(rng).with_keyframe()
    step = increment(rng)
    plain = JointState.at_start(0 * SIGMAS).then(step)
    added = state.then(step).doubted(10.0).covariance - state.then(step).covariance
    turned = compose(np.append(np.zeros(2), state.pose[2]), np.zeros(3))[2]
    c, s = np.cos(turned), np.sin(turned)
    R = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    assert np.abs(added[POSE, POSE] - 9 * R @ plain.pose_covariance @ R.T).max() < 1e-12
    assert not added[3:].any()
    once = state.then(step).doubted(10.0)
    assert np.array_equal(once.doubted(10.0).covariance, once.covariance), "doubted once"
    later = once.then(step)
    assert not np.array_equal(later.doubted(10.0).covariance, later.covariance), "but not this"
