"""Lines in the robot's lidar: as near as was asked, and honest, over sills that tilt the robot.

`grouser compare --world room --estimators ekf-line-slam --steps 3400 --seeds 5` drives the 100 m.
"""

import gymnasium as gym
import numpy as np
import pytest

import grouser  # noqa: F401  (registers the environments)
from grouser.estimators import make
from grouser.estimators.evaluation.comparison import Run, compare_open_loop
from grouser.estimators.evaluation.metrics import ate_se2
from grouser.estimators.evaluation.summary import summarise
from grouser.scripts.compare_tour import tour

STEPS = 640
"""Two sills in the corridor, and 20 m."""


def driven(world: str, seed: int, sensors: tuple[str, ...] = ("tracks", "lidar", "imu")) -> Run:
    env = gym.make("grouser/TrackedRobot-v0", world=world, sensors=sensors)
    scout = gym.make("grouser/TrackedRobot-v0", world=world, sensors=())
    rig = env.get_wrapper_attr("rig")
    drive = tour(scout, seed, STEPS)
    (run,) = compare_open_loop(
        env, {"lines": make("ekf-line-slam", rig)}, drive, seed=seed, steps=STEPS
    )
    return run


@pytest.fixture(scope="module")
def runs() -> list[Run]:
    return [driven("corridor", 1), driven("room", 0)]


def steepest(run: Run) -> float:
    """Degrees by which the robot tilted."""
    assert run.true_poses_3d is not None
    return float(np.degrees(np.arccos(np.clip(run.true_poses_3d[:, 2, 2], -1, 1))).max())


def test_the_way_is_known_and_it_is_known_how_well(runs: list[Run]) -> None:
    told = [summarise(run, "test") for run in runs]
    assert max(t["ate_m"] for t in told) < 0.02, "0.10 m were asked for"
    assert 1.5 < np.mean([t["nees_mean"] for t in told]) < 4.5
    assert steepest(runs[0]) > 5, "there was a sill"


def test_it_is_the_imu_that_tells_a_tilt_from_a_motion(runs: list[Run]) -> None:
    blind = driven("corridor", 1, ("tracks", "lidar"))
    assert blind.true_poses is not None
    poses = [np.array([e.pose for e in run.estimates]) for run in (blind, runs[0])]
    ate = [ate_se2(blind.true_poses, estimated) for estimated in poses]
    assert ate[1] < ate[0]
