"""On the simulated robot, whose slip, pitch and pixels are nobody's model: small, honest errors."""

from dataclasses import dataclass
from typing import Any

import gymnasium as gym
import numpy as np
import pytest

import grouser  # noqa: F401  (registers the environments)
from grouser.estimators import Status, make
from grouser.estimators.evaluation.consistency import mean_bounds, nees
from grouser.geometry import Array, between
from grouser.rig import Rig

STEPS, SEEDS = 50, (0, 1, 2)


@dataclass(frozen=True)
class Rollout:
    rig: Rig
    observations: list[dict[str, Any]]
    truths: Array
    """(STEPS + 1, 3) in the frame of the start"""


@pytest.fixture(scope="module")
def rollouts() -> list[Rollout]:
    """A winding drive for each seed."""
    env = gym.make("grouser/TrackedRobot-v0", sensors=("left", "right", "tracks"))
    found = []
    for seed in SEEDS:
        shown, info = env.reset(seed=seed)
        observations, poses = [shown], [info["true_pose"]]
        for k in range(STEPS):
            winding = 0.15 * np.sin(k / 8)
            shown, _, _, _, info = env.step(np.array([0.5 - winding, 0.5 + winding], np.float32))
            observations.append(shown)
            poses.append(info["true_pose"])
        truths = between(poses[0], np.array(poses))
        found.append(Rollout(env.get_wrapper_attr("rig"), observations, truths))
    env.close()
    return found


@pytest.mark.parametrize("tracks", [True, False])
@pytest.mark.parametrize("name", ["one-point-ransac", "five-point-ransac"])
def test_errors_are_small_and_as_large_as_said(
    rollouts: list[Rollout], name: str, tracks: bool
) -> None:
    run_nees = []
    for rollout in rollouts:
        unseen = set() if tracks else {"tracks"}
        shown = [{k: o[k] for k in o.keys() - unseen} for o in rollout.observations]
        estimator = make(name, rollout.rig)
        estimator.reset(shown[0], rng=np.random.default_rng(0))
        estimates = [estimator.update(observation) for observation in shown[1:]]
        assert {e.status for e in estimates} == {Status.TRACKING}
        poses, truths = np.array([e.pose for e in estimates]), rollout.truths[1:]
        way = np.linalg.norm(np.diff(rollout.truths[:, :2], axis=0), axis=1).sum()
        error = between(truths[-1], poses[-1])
        assert np.linalg.norm(error[:2]) < 0.01 * way and abs(error[2]) < np.radians(0.3)
        run_nees.append(nees(truths, poses, np.array([e.covariance for e in estimates])).mean())
    # Frames of one run are not independent: three runs are three samples of chi-square(3).
    low, high = mean_bounds(len(SEEDS), confidence=0.998)
    assert low < np.mean(run_nees) < high
