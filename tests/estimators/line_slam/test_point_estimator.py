"""`ekf-point-slam` in paper 2's world: honest with points, and what the paper made of it."""

from typing import Any

import gymnasium as gym
import numpy as np
import pytest

import grouser  # noqa: F401
from grouser.agents.steering import SteeringDriver
from grouser.envs.line_world import LineWorldEnv
from grouser.estimators import PoseEstimate, Status, make
from grouser.estimators.base import readable
from grouser.estimators.line_slam.point_estimator import EkfPointSlam
from grouser.geometry import wrap

STEPS = 2200


def drive(seed: int, **options: Any) -> tuple[float, float, int]:
    """RMS of the position [m], mean NEES, and points in the map."""
    seen = "lines" if "landmarks" in options else "points"
    env = gym.make("grouser/LineWorld-v0", sensors=("steering", seen)).unwrapped
    assert isinstance(env, LineWorldEnv)
    estimator = make("ekf-point-slam", env.rig, **options)
    assert isinstance(estimator, EkfPointSlam)
    observation, info = env.reset(seed=seed)
    estimator.reset(readable(estimator, observation, info), rng=np.random.default_rng(0))
    driver = SteeringDriver(env.rig, env.world.course)
    errors, nees = [], []
    for step in range(STEPS):
        action = driver(PoseEstimate(info["true_pose"], np.eye(3), Status.TRACKING, 0.0))
        assert action is not None
        observation, *_, info = env.step(action.astype(np.float32))
        estimate = estimator.update(readable(estimator, observation, info))
        error = estimate.pose - info["true_pose"]
        error[2] = wrap(error[2])
        errors.append(error[:2])
        if step > 40:  # at the start the pose is known exactly
            nees.append(float(error @ np.linalg.solve(estimate.covariance, error)))
    rms = float(np.sqrt(np.mean(np.sum(np.square(errors), axis=1))))
    return rms, float(np.mean(nees)), len(estimator.map)


SEEDS = range(3)


def test_with_points_it_is_as_good_as_it_says() -> None:
    rms, nees, points = np.mean([drive(seed) for seed in SEEDS], axis=0)
    assert rms < 0.35 and nees < 6 and points == 4


@pytest.mark.parametrize(
    ("options", "too_sure"),
    [
        ({"paper": True}, 8),
        ({"paper_observation": True}, 30),
        ({"landmarks": "estimated-feet", "origin": (0.0, -35.0)}, 15),
    ],
)
def test_as_printed_it_is_too_sure(options: dict[str, Any], too_sure: float) -> None:
    _, nees, _ = np.mean([drive(seed, **options) for seed in SEEDS], axis=0)
    assert nees > too_sure


def test_feet_by_the_estimated_pose_make_landmarks_that_are_not_there() -> None:
    run = drive(0, landmarks="estimated-feet", origin=(0.0, -35.0))
    assert run[2] > 6


def test_what_it_cannot_do_is_refused() -> None:
    env = gym.make("grouser/LineWorld-v0", sensors=("steering", "lines")).unwrapped
    assert isinstance(env, LineWorldEnv)
    with pytest.raises(ValueError, match="landmarks must be one of points, estimated-feet"):
        make("ekf-point-slam", env.rig, landmarks="feet")
    with pytest.raises(ValueError, match="needs rig.line_sensor"):
        make("ekf-point-slam", env.rig.with_overrides({"line_sensor": None}))
    estimator = make("ekf-point-slam", env.rig)
    with pytest.raises(RuntimeError, match="call reset"):
        estimator.update({})
    observation, _ = env.reset(seed=0)
    with pytest.raises(ValueError, match="landmarks='points' needs 'points'"):
        estimator.reset(observation, rng=np.random.default_rng(0))
