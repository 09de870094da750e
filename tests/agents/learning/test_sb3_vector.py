"""Stable-Baselines3 sees the same episodes that single environments show."""

import numpy as np
import pytest

pytest.importorskip(
    "stable_baselines3", reason="Stable-Baselines3 is not installed: pip install -e '.[rl]'"
)

from grouser.agents.learning.sb3_vector import Sb3Vector
from grouser.agents.learning.task import TrainingTask

TASK = TrainingTask(estimator="dead-reckoning")


def test_each_environment_shows_what_a_single_one_does() -> None:
    vector = Sb3Vector(TASK.makers(3))
    vector.seed(7)
    batch = vector.reset()
    single = TASK.make("depot")
    shown, _ = single.reset(seed=9)
    actions = np.random.default_rng(0).uniform(0, 1, (20, 3, 2)).astype(np.float32)
    for action in actions:
        for key, value in shown.items():
            np.testing.assert_array_equal(batch[key][2], value)
        batch, rewards, dones, _ = vector.step(action)
        shown, reward, *_ = single.step(action[2])
        assert rewards[2] == np.float32(reward) and not dones[2]
    vector.close()


def test_the_end_of_an_episode_is_told() -> None:
    vector = Sb3Vector(TASK.makers(2))
    vector.seed(0)
    vector.reset()
    straight_on = np.ones((2, 2), dtype=np.float32)
    total, length, dones = np.zeros(2), 0, np.zeros(2, dtype=bool)
    while not dones.any():
        batch, rewards, dones, infos = vector.step(straight_on)
        total, length = total + rewards, length + 1
    (k,) = np.flatnonzero(dones)[:1]
    assert infos[k]["is_success"] is False and infos[k]["TimeLimit.truncated"] is False
    assert infos[k]["episode"]["l"] == length
    assert infos[k]["episode"]["r"] == pytest.approx(total[k], abs=1e-4)
    last, first = infos[k]["terminal_observation"], {key: v[k] for key, v in batch.items()}
    np.testing.assert_allclose(last["last_action"], [1, 1])
    np.testing.assert_allclose(first["last_action"], [0, 0])
    vector.close()
