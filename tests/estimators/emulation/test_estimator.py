"""The emulated estimator: its errors come from the seed, and it says what it cannot emulate."""

from pathlib import Path

import gymnasium as gym
import numpy as np
import pytest

import grouser  # noqa: F401  (registers the environments)
from grouser.estimators import EstimatedPose, Status, make
from grouser.estimators.emulation.model_file import save_model
from grouser.geometry import Array, compose
from grouser.rig import Rig
from tests.estimators.emulation.models import drifting, model, way

ACTION = np.array([0.6, 0.4], dtype=np.float32)


def drive(of: str, *, seed: int, steps: int = 30) -> Array:
    env = EstimatedPose(
        gym.make("grouser/TrackedRobot-v0", sensors=(), dynamics="fast"), "emulated", of=of
    )
    env.reset(seed=seed)
    poses = [env.step(ACTION)[0]["pose"] for _ in range(steps)]
    env.close()
    return np.array(poses)


def test_errors_come_from_the_seed() -> None:
    first, again, other = (drive("dead-reckoning", seed=s) for s in (3, 3, 4))
    assert np.array_equal(first, again)
    assert not np.array_equal(first, other)


def test_it_starts_where_the_first_observation_was(tmp_path: Path) -> None:
    save_model(tmp_path / "none.json", model())
    estimator = make("emulated", Rig(dt=0.1), of=str(tmp_path / "none.json"))
    truth, start = way(40), np.array([3.0, -2.0, 1.0])
    for frame, pose in enumerate(truth):
        seen = {"true_pose": compose(start, pose), "stamp": np.array([0.1 * frame])}
        if frame == 0:
            estimate = estimator.reset(seen, rng=np.random.default_rng(0))
        else:
            estimate = estimator.update(seen)
        np.testing.assert_allclose(estimate.pose, pose, atol=1e-9)
        assert estimate.status is Status.TRACKING


def test_it_gets_lost_and_comes_back(tmp_path: Path) -> None:
    chances = np.array([[0.9, 0.1, 0.0], [0.0, 0.5, 0.5], [0.25, 0.0, 0.75]])
    save_model(tmp_path / "lossy.json", drifting(transitions=chances))
    estimator = make("emulated", Rig(dt=0.1), of=str(tmp_path / "lossy.json"))
    seen = {"true_pose": np.zeros(3), "stamp": np.zeros(1)}
    estimator.reset(seen, rng=np.random.default_rng(0))
    told = [estimator.update(seen).status for _ in range(4000)]
    # The chain's stationary shares: 10, 2 and 4 of 16.
    for status, share in zip(Status, (10 / 16, 2 / 16, 4 / 16), strict=True):
        assert told.count(status) / len(told) == pytest.approx(share, abs=0.06)


def test_another_time_step_is_refused() -> None:
    with pytest.raises(ValueError, match=r"steps of 0.1 s, and this robot's take 0.05 s; fit one"):
        make("emulated", Rig(dt=0.05))


def test_reset_comes_first() -> None:
    with pytest.raises(RuntimeError, match="call reset"):
        make("emulated", Rig(dt=0.1)).update({"true_pose": np.zeros(3), "stamp": np.zeros(1)})
