"""How fast policies are trained and tried: steps a second of the goal task, of all processors."""

from functools import partial

import numpy as np

from grouser.agents.learning.task import TrainingTask
from grouser.agents.learning.terse_vector import terse_vector
from grouser.agents.navigation import GoalNavEnv
from grouser.envs.fleet.crew import Maker
from grouser.scripts.benchmark_timing import Figures, Measurement, seconds

_ROUNDS = 8


def emulated() -> Figures:
    """The stack of `grouser train`: fast dynamics, lidar, emulated line SLAM, the policy's view."""
    return {"training.emulated_sps": (_rate(TrainingTask().makers(16), n=100), "1/s")}


def line_slam() -> Figures:
    """Physics, lidar and line SLAM."""
    return {"training.line_slam_sps": (_rate(_physics("ekf-line-slam"), n=40), "1/s")}


def visual() -> Figures:
    """Physics, stereo images and one-point RANSAC, lidar for the policy."""
    return {"training.visual_sps": (_rate(_physics("one-point-ransac"), n=15), "1/s")}


MEASUREMENTS = (
    Measurement(emulated, ("training.emulated_sps",)),
    Measurement(line_slam, ("training.line_slam_sps",)),
    Measurement(visual, ("training.visual_sps",)),
)


def _physics(estimator: str) -> list[Maker]:
    return [partial(GoalNavEnv, estimator=estimator, robot={"dynamics": "bullet"})] * 4


def _rate(makers: list[Maker], *, n: int) -> float:
    """Steps a second of them together: the median of some rounds of n steps of each, driven ahead
    in curves; episodes that end, and the worlds of the next ones, are in it."""
    vector, rng = terse_vector(makers), np.random.default_rng(0)
    vector.reset(seed=0)

    def drive() -> None:
        for _ in range(n):
            vector.step(rng.uniform(-0.1, 1.0, (len(makers), 2)).astype(np.float32))

    drive()  # kernels load
    rates = [n * len(makers) / seconds(drive) for _ in range(_ROUNDS)]
    vector.close()
    return float(np.median(rates))
