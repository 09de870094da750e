"""What a second process brings: an asynchronous vector of two environments against one."""

from itertools import cycle

import gymnasium as gym
import numpy as np

import grouser  # noqa: F401  (registers the environments)
from grouser.envs.sensors.stereo import EYES
from grouser.envs.sensors.suite import DEFAULT_SENSORS
from grouser.scripts.benchmark_timing import Figures, Measurement, curves, seconds

_ID = "grouser/TrackedRobot-v0"
_ROUNDS = 8


def two_processes_with_images() -> Figures:
    """Steps of a vector of two for every step of one environment, with stereo 320x240."""
    return {"environment.async2_over_1_images": (_gain(list(DEFAULT_SENSORS), n=15), "ratio")}


def two_processes_without_images() -> Figures:
    """The same without images."""
    blind = [key for key in DEFAULT_SENSORS if key not in EYES]
    return {"environment.async2_over_1_blind": (_gain(blind, n=100), "ratio")}


MEASUREMENTS = (
    Measurement(two_processes_with_images, ("environment.async2_over_1_images",)),
    Measurement(two_processes_without_images, ("environment.async2_over_1_blind",)),
)


def _gain(sensors: list[str], *, n: int) -> float:
    """Both take turns, n steps at a time, so that whatever else the machine does slows both."""
    one = gym.make(_ID, sensors=sensors)
    two = gym.make_vec(_ID, 2, sensors=sensors)
    one.reset(seed=0)
    two.reset(seed=0)
    actions = cycle(curves())
    pairs = cycle(np.stack([action, action]) for action in curves())

    def steps_of_one() -> None:
        for _ in range(n):
            one.step(next(actions))

    def steps_of_two() -> None:
        for _ in range(n):
            two.step(next(pairs))

    steps_of_one()  # kernels load
    steps_of_two()
    alone, together = [], []
    for _ in range(_ROUNDS):
        alone.append(seconds(steps_of_one))
        together.append(seconds(steps_of_two))
    one.close()
    two.close()
    return float(2 * np.median(alone) / np.median(together))
