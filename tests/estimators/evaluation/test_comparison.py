"""All estimators of a comparison see the same bits, no truth, and the same randomness."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from grouser.estimators import registry
from grouser.estimators.base import PoseEstimate, PoseEstimator
from grouser.estimators.evaluation.comparison import (
    Run,
    compare_closed_loop,
    compare_open_loop,
)
from grouser.estimators.ground_truth import GroundTruth
from grouser.estimators.wrapper import EstimatedPose
from grouser.geometry import Array

Make = Callable[..., Any]
STEPS = 40


def drive(step: int) -> Array:
    return np.array([0.5, 0.5 + 0.3 * np.sin(step / 5)])


def poses(run: Run) -> Array:
    return np.array([estimate.pose for estimate in run.estimates])


def test_every_estimator_sees_the_same_bits(robot: Make, witness: Make) -> None:
    witnesses = {name: witness() for name in ("a", "b", "c")}
    compare_open_loop(robot(), witnesses, drive, seed=3, steps=STEPS)
    a, b, c = (one.seen for one in witnesses.values())
    assert len(a) == STEPS + 1
    assert a == b == c


def test_no_estimator_sees_the_truth_or_what_it_did_not_declare(robot: Make, witness: Make) -> None:
    one = witness()
    compare_open_loop(robot(), {"a": one}, drive, seed=0, steps=3)
    assert all(set(seen) == {"tracks", "stamp"} for seen in one.seen)


def test_who_spoils_an_observation_spoils_it_for_itself(
    robot: Make, witness: Make, vandal: Make
) -> None:
    alone, beside = witness(), witness()
    compare_open_loop(robot(), {"a": alone}, drive, seed=0, steps=STEPS)
    compare_open_loop(robot(), {"v": vandal(), "a": beside}, drive, seed=0, steps=STEPS)
    assert alone.seen == beside.seen


def test_company_order_and_name_change_nothing(robot: Make, witness: Make) -> None:
    first, second, alone = witness(), witness(), witness()
    compare_open_loop(robot(), {"a": first, "b": second}, drive, seed=0, steps=3)
    compare_open_loop(robot(), {"other": alone}, drive, seed=0, steps=3)
    np.testing.assert_array_equal(first.draws, second.draws)
    np.testing.assert_array_equal(first.draws, alone.draws)


def test_another_seed_is_another_run_and_zero_is_a_seed(robot: Make, witness: Make) -> None:
    draws: dict[int, Any] = {}
    for seed in (0, 1, 0):
        one = witness()
        compare_open_loop(robot(), {"a": one}, drive, seed=seed, steps=3)
        again = draws.setdefault(seed, (one.draws, one.seen))
        np.testing.assert_array_equal(again[0], one.draws)
        assert again[1] == one.seen
    assert draws[0][1] != draws[1][1]
    assert (draws[0][0] != draws[1][0]).all()


def test_an_estimator_shares_no_randomness_with_the_environment(robot: Make, witness: Make) -> None:
    """An environment spawns its streams from the bare seed; a sampler must not follow one."""
    one = witness()
    compare_open_loop(robot(), {"a": one}, drive, seed=0, steps=1)
    root = np.random.default_rng(0)
    streams = [np.random.default_rng(0), *root.spawn(20)]
    assert not any((one.draws == rng.integers(0, 2**62, 3)).any() for rng in streams)


def test_the_wrapper_gives_the_same_bits(robot: Make) -> None:
    """What a policy is fed is what was compared."""
    rig = robot().rig
    estimator = registry.make("dead-reckoning", rig)
    (run,) = compare_open_loop(robot(), {"dr": estimator}, drive, seed=5, steps=STEPS)
    env = EstimatedPose(robot(), "dead-reckoning")
    observation, _ = env.reset(seed=5)
    fed = [observation["pose"]]
    for step in range(STEPS):
        observation, *_ = env.step(drive(step).astype(np.float32))
        fed.append(observation["pose"])
    np.testing.assert_array_equal(np.array(fed), poses(run))


def test_the_truth_is_recorded_beside_the_estimates(robot: Make) -> None:
    estimator = GroundTruth(robot().rig)
    (run,) = compare_open_loop(robot(), {"gt": estimator}, drive, seed=0, steps=STEPS)
    assert run.true_poses is not None and run.true_poses_3d is not None
    assert run.true_poses.shape == (STEPS + 1, 3)
    np.testing.assert_allclose(poses(run), run.true_poses, atol=1e-12)
    np.testing.assert_allclose(run.stamps, 0.1 * np.arange(STEPS + 1))
    assert run.update_ms.shape == (STEPS,)
    assert (run.update_ms > 0).all()


def test_a_recording_without_truth_can_be_compared(robot: Make, witness: Make) -> None:
    (run,) = compare_open_loop(robot(truth=False), {"a": witness()}, drive, seed=0, steps=3)
    assert run.true_poses is None and run.true_poses_3d is None


def test_an_estimator_that_cannot_be_fed_is_named(robot: Make) -> None:
    estimator: PoseEstimator = GroundTruth(robot().rig)
    with pytest.raises(ValueError, match=r"GroundTruth requires \['true_pose', 'true_pose_3d'\]"):
        compare_open_loop(robot(truth=False), {"gt": estimator}, drive, seed=0, steps=3)


@pytest.mark.parametrize(
    ("length", "steps", "expected"), [(None, 7, 7), (5, None, 5), (5, 7, 5), (9, 7, 7)]
)
def test_a_rollout_ends_with_the_steps_or_the_episode(
    robot: Make, witness: Make, length: int | None, steps: int | None, expected: int
) -> None:
    calls: list[int] = []
    (run,) = compare_open_loop(
        robot(length), {"a": witness()}, drive, seed=0, steps=steps, on_step=lambda: calls.append(1)
    )
    assert len(run.estimates) == expected + 1
    assert len(calls) == expected


def test_a_closed_loop_drives_on_the_estimate_until_the_driver_is_done(
    robot: Make, witness: Make
) -> None:
    given: list[PoseEstimate] = []

    def driver(estimate: PoseEstimate) -> Array | None:
        given.append(estimate)
        return None if estimate.pose[0] > 0.2 else np.array([0.6, 0.6])

    run = compare_closed_loop(robot(), "a", witness(), driver, seed=0, steps=100)
    assert [id(estimate) for estimate in given] == [id(estimate) for estimate in run.estimates]
    assert run.estimates[-1].pose[0] > 0.2 > run.estimates[-2].pose[0]
    assert len(run.estimates) < 20
