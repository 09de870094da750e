"""Drivers reach goals by what a robot may know, each behind the same interface."""

from typing import Any

import numpy as np
import pytest

from grouser.agents.driver import Driver
from grouser.agents.drivers import CLASSICAL, make_driver
from grouser.agents.navigation import GoalNavEnv
from grouser.estimators.base import PoseEstimate, Status


def made(driver: Driver, **options: Any) -> GoalNavEnv:
    return GoalNavEnv(**{"robot": {"dynamics": "fast"}, **driver.task, **options})


def outcomes(name: str, *, seeds: int, **options: Any) -> list[str]:
    """How episodes end under a driver."""
    driver = make_driver(name)
    env, ends = made(driver, **options), []
    for seed in range(seeds):
        shown, _ = env.reset(seed=seed)
        driver.reset(env.rig, env.world)
        ended = False
        while not ended:
            action = driver.action(shown, env.believed, env.goal)
            assert action in env.action_space
            shown, _, terminated, truncated, info = env.step(action)
            ended = terminated or truncated
        ends.append(info["outcome"])
    return ends


@pytest.mark.parametrize("world", ["yard", "room", "forest"])
def test_with_a_map_and_the_true_pose_every_goal_is_reached(world: str) -> None:
    ends = outcomes("pursuit", seeds=6, estimator="ground-truth", world=world)
    assert ends == ["success"] * 6


def test_a_plan_is_for_each_goal() -> None:
    assert outcomes("pursuit", seeds=2, estimator="ground-truth", goals=3) == ["success"] * 2


def test_straight_at_the_goal_works_in_the_open_alone() -> None:
    ends = outcomes("straight", seeds=8, estimator="ground-truth", world="room")
    assert "collision" in ends


def test_by_lidar_alone_it_goes_around_what_it_sees() -> None:
    straight = outcomes("straight", seeds=8, estimator="ground-truth")
    around = outcomes("dynamic-window", seeds=8, estimator="ground-truth")
    assert straight.count("success") < around.count("success")
    assert around.count("success") >= 5  # boxes lower than the lidar are not seen


@pytest.mark.parametrize("name", CLASSICAL)
def test_a_lost_robot_stands_still(name: str) -> None:
    driver = make_driver(name)
    env = made(driver)
    shown, _ = env.reset(seed=0)
    driver.reset(env.rig, env.world)
    lost = PoseEstimate(np.zeros(3), np.eye(3), Status.LOST, 0.0)
    assert driver.action(shown, lost, env.goal).tolist() == [0.0, 0.0]


@pytest.mark.parametrize("name", CLASSICAL)
def test_the_same_is_done_again_after_a_reset(name: str) -> None:
    driver = make_driver(name)
    env = made(driver)
    actions = []
    for _ in range(2):
        shown, _ = env.reset(seed=1)
        driver.reset(env.rig, env.world)
        for _ in range(5):
            action = driver.action(shown, env.believed, env.goal)
            shown = env.step(action)[0]
        actions.append(action)
    assert np.array_equal(actions[0], actions[1])


def test_a_start_or_goal_in_an_obstacles_margin_is_planned_from_beside_it() -> None:
    driver = make_driver("pursuit")
    env = made(driver)
    env.reset(seed=0)
    driver.reset(env.rig, env.world)
    for place in env.world.solids.centre[:, :2]:
        believed = PoseEstimate(np.append(place, 0.0), np.eye(3), Status.TRACKING, 0.0)
        assert np.isfinite(driver.action({}, believed, env.goal)).all()


def test_unknown_names_are_refused() -> None:
    with pytest.raises(ValueError, match="no driver is named 'pursiut'.*did you mean 'pursuit'"):
        make_driver("pursiut")
