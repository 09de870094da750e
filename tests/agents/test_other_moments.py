"""Shuffled covariances are those of other episodes: as large as often, and blind to this moment."""

import json
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.envs.registration import EnvSpec

import grouser  # noqa: F401  registers the environments
from grouser.agents.drive import steps
from grouser.agents.navigation import GoalNavEnv
from grouser.agents.pursuit import Pursuit
from grouser.geometry import Array

OPTIONS: dict[str, Any] = {"estimator": "dead-reckoning", "robot": {"dynamics": "fast"}}
FORWARD = np.array([0.6, 0.5], dtype=np.float32)


def shown_and_own(env: GoalNavEnv, n: int = 60, **reset: Any) -> tuple[Array, Array]:
    """(n, 6) of both: the covariances shown, and those of the estimate."""
    shown, own = [env.reset(**reset)[0]], [env.believed]
    while len(shown) < n:
        shown.append(env.step(FORWARD)[0])
        own.append(env.believed)
    upper = [estimate.covariance[np.triu_indices(3)] for estimate in own]
    return np.array([each["pose_covariance"] for each in shown]), np.array(upper)


def test_nothing_else_changes() -> None:
    plain, told, shuffled = (
        GoalNavEnv(covariance=kind, **OPTIONS) for kind in (False, True, "shuffled")
    )
    views = [env.reset(seed=3)[0] for env in (plain, told, shuffled)]
    for _ in range(20):
        views = [env.step(FORWARD)[0] for env in (plain, told, shuffled)]
        for key in views[0]:
            assert np.array_equal(views[0][key], views[1][key])
            assert np.array_equal(views[0][key], views[2][key])
    assert shuffled.observation_space == told.observation_space


def test_they_tell_nothing_of_the_moment() -> None:
    """Dead reckoning's sigma grows step by step; shuffled it does not follow the time."""
    env = GoalNavEnv(covariance="shuffled", **OPTIONS)
    shown, own = shown_and_own(env, 200, seed=0)
    n = np.arange(200)
    assert np.corrcoef(n, own[:, 5])[0, 1] > 0.9
    assert abs(np.corrcoef(n, shown[:, 5])[0, 1]) < 0.2  # 0.07 would be one sigma


def test_they_are_as_large_as_often() -> None:
    """Of many episodes of the same driver, quantiles of what is shown are those of what is told."""
    env = GoalNavEnv(covariance="shuffled", **OPTIONS)
    env.reset(seed=0)
    driver, shown, own = Pursuit(), [], []
    for episode in range(30):
        view, _ = env.reset(seed=0) if episode == 0 else env.reset()
        driver.reset(env.rig, env.world)
        ended = False
        while not ended:
            view, _, over, late, _ = env.step(driver.action(view, env.believed, env.goal))
            shown.append(float(view["pose_covariance"][5]))
            own.append(env.believed.covariance[2, 2])
            ended = over or late
    levels = [0.25, 0.5, 0.75]
    assert np.quantile(shown, levels) == pytest.approx(np.quantile(own, levels), rel=0.25)


def test_they_are_of_other_episodes() -> None:
    env = GoalNavEnv(covariance="shuffled", **OPTIONS)
    first_shown, first_own = shown_and_own(env, seed=5)
    assert not set(first_own[5:, 0].astype(np.float32)) & set(first_shown[:, 0].tolist())
    later = np.concatenate([shown_and_own(env)[0] for _ in range(20)])
    assert set(first_own[5:, 0].astype(np.float32).tolist()) & set(later[:, 0].tolist())


def test_a_seed_gives_the_same_again() -> None:
    env = GoalNavEnv(covariance="shuffled", **OPTIONS)
    first = shown_and_own(env, seed=7)[0]
    shown_and_own(env)
    assert np.array_equal(first, shown_and_own(env, seed=7)[0])
    spec = gym.make("grouser/GoalNav-v0", covariance="shuffled", **OPTIONS).spec
    assert spec is not None and json.loads(spec.to_json())["kwargs"]["covariance"] == "shuffled"
    twin = gym.make(EnvSpec.from_json(spec.to_json())).unwrapped
    assert isinstance(twin, GoalNavEnv)
    assert np.array_equal(first, shown_and_own(twin, seed=7)[0])
    assert not np.array_equal(first, shown_and_own(twin, seed=8)[0])


def test_the_goals_stay_those_of_the_seed() -> None:
    ways = []
    for kind in (True, "shuffled"):
        env = GoalNavEnv(covariance=kind, goals=2, **OPTIONS)
        last = list(steps(env, Pursuit(), 4))[-1]
        ways.append((last.info["shortest_path"], last.info["outcome"]))
    assert ways[0] == ways[1]


@pytest.mark.parametrize("kind", ["shufled", None, 2])
def test_another_word_is_refused(kind: Any) -> None:
    with pytest.raises(ValueError, match='covariance must be True, False or "shuffled", got'):
        GoalNavEnv(covariance=kind, **OPTIONS)
