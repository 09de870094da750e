"""The naive stack stands in the same world as our own: else the comparison would mean nothing."""

from collections.abc import Iterator

import numpy as np
import pytest

from grouser.envs.simulation.robot import RobotModel
from grouser.envs.simulation.world import World
from grouser.envs.tracked_robot import TrackedRobotEnv
from grouser.scripts.benchmark_environment import _SEED, _world
from grouser.scripts.naive_stack import NaiveStack


@pytest.fixture(scope="module")
def env() -> Iterator[TrackedRobotEnv]:
    env = TrackedRobotEnv(
        effects={"stereo.read_noise": 0.0, "lidar.range_noise": 0.0, "lidar.bearing_noise": 0.0}
    )
    yield env
    env.close()


@pytest.fixture(scope="module")
def world() -> World:
    return _world()


@pytest.fixture(scope="module")
def naive(world: World, env: TrackedRobotEnv) -> Iterator[NaiveStack]:
    naive = NaiveStack(world, env.rig, RobotModel())
    yield naive
    naive.close()


def test_its_lidar_sees_the_world_that_our_own_is_measured_in(
    naive: NaiveStack, env: TrackedRobotEnv
) -> None:
    theirs = naive.step(np.zeros(2, dtype=np.float32))["lidar"]
    ours = env.reset(seed=_SEED)[0]["lidar"]
    assert np.median(np.abs(theirs - ours)) < 0.02  # it stands a little askew on its wheels


def test_its_images_show_the_same_world(naive: NaiveStack) -> None:
    observation = naive.step(np.zeros(2, dtype=np.float32))
    assert observation["left"].shape == observation["right"].shape == (240, 320)
    ground = observation["left"][160:].astype(np.float64)
    assert ground.std() > 30  # textured
    assert np.abs(observation["left"].astype(np.float64) - observation["right"]).mean() > 5


def test_its_wheels_drive_it(naive: NaiveStack) -> None:
    travelled = sum(naive.step(np.ones(2, dtype=np.float32))["tracks"] for _ in range(3))
    assert np.all(travelled > 0.05)
