"""Vectors of robots: the bits of single ones, and a share of the processors for each."""

import os
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.vector import AsyncVectorEnv

import grouser  # noqa: F401 - registers the environments
from grouser.envs.tracked_robot import TrackedRobotEnv
from grouser.envs.vector import processors, tracked_robots

OPTIONS: dict[str, Any] = {"sensors": ["left", "imu"], "image_size": [64, 48], "dynamics": "fast"}
FORWARD = np.full((3, 2), 0.5, np.float32)


def test_gymnasium_makes_processes_of_their_own_by_default() -> None:
    vector = gym.make_vec("grouser/TrackedRobot-v0", 3, **OPTIONS)
    assert isinstance(vector, AsyncVectorEnv)
    shown = [vector.reset(seed=5)[0], vector.step(FORWARD)[0]]
    env = TrackedRobotEnv(**OPTIONS)
    for index in range(3):
        alone = [env.reset(seed=5 + index)[0], env.step(FORWARD[index])[0]]
        for one, together in zip(alone, shown, strict=True):
            assert all(np.array_equal(one[key], together[key][index]) for key in one)
    vector.close()
    env.close()


@pytest.mark.parametrize("method", ["fork", "spawn"])
def test_every_start_method_gives_the_same(method: str) -> None:
    vector = tracked_robots(2, context=method, **OPTIONS)
    env = TrackedRobotEnv(**OPTIONS)
    assert np.array_equal(vector.reset(seed=0)[0]["left"][0], env.reset(seed=0)[0]["left"])
    vector.close()
    env.close()


needs_affinity = pytest.mark.skipif(
    not hasattr(os, "sched_getaffinity"), reason="this system does not let processes choose"
)


@needs_affinity
@pytest.mark.parametrize("of", [1, 2, 3, 5, 8, 20])
def test_processors_are_dealt_out_fairly(of: int, monkeypatch: pytest.MonkeyPatch) -> None:
    own = {2, 3, 5, 7, 11, 13, 17, 19}
    monkeypatch.setattr(os, "sched_getaffinity", lambda pid: own)
    shares = [processors(index, of) for index in range(of)]
    assert frozenset().union(*shares) == own and all(shares)
    sizes = {len(share) for share in shares}
    assert max(sizes) - min(sizes) <= 1
    if of <= len(own):
        assert sum(map(len, shares)) == len(own), "nobody shares"


@needs_affinity
def test_workers_keep_to_their_share_and_the_caller_to_nothing() -> None:
    before = os.sched_getaffinity(0)
    vector = tracked_robots(2, sensors=["imu"])
    vector.reset(seed=0)
    workers = [os.sched_getaffinity(process.pid or -1) for process in vector.processes]
    assert workers == [processors(0, 2), processors(1, 2)]
    assert os.sched_getaffinity(0) == before
    vector.close()
