"""What a second process brings: an asynchronous vector of two environments against one."""

import multiprocessing
from itertools import cycle
from multiprocessing.connection import Connection

import gymnasium as gym
import numpy as np

import grouser  # noqa: F401  (registers the environments)
from grouser.envs.fleet.shares import keeping_to, processors
from grouser.envs.sensors.stereo import EYES
from grouser.envs.sensors.suite import DEFAULT_SENSORS
from grouser.scripts.benchmark_timing import Figures, Measurement, curves, seconds

_ID = "grouser/TrackedRobot-v0"
_ROUNDS = 8


def with_images() -> Figures:
    """Steps of two for every step of one environment, with stereo 320x240."""
    return _gains("images", list(DEFAULT_SENSORS), n=15)


def without_images() -> Figures:
    """The same without images."""
    return _gains("blind", [key for key in DEFAULT_SENSORS if key not in EYES], n=100)


def _names(what: str) -> tuple[str, str]:
    return f"environment.async2_over_1_{what}", f"environment.strangers2_over_1_{what}"


MEASUREMENTS = (
    Measurement(with_images, _names("images")),
    Measurement(without_images, _names("blind")),
)


def _gains(what: str, sensors: list[str], *, n: int) -> Figures:
    """By a vector of two, and by two processes that have nothing to do with one another, each on a
    processor of its own: what this machine's second processor is worth.

    Against the same drives through the same two worlds, one after the other in one process. All
    take turns, n steps at a time, so that whatever else the machine does slows all.
    """
    ones = [gym.make(_ID, sensors=sensors) for _ in range(2)]
    two = gym.make_vec(_ID, 2, sensors=sensors)
    strangers = [_Stranger(sensors, k) for k in range(2)]
    for k, one in enumerate(ones):
        one.reset(seed=k)
    two.reset(seed=0)
    singles = [cycle(curves()) for _ in ones]
    pairs = cycle(np.stack([action, action]) for action in curves())

    def steps_of_one() -> None:
        for one, actions in zip(ones, singles, strict=True):
            for _ in range(n):
                one.step(next(actions))

    def steps_of_two() -> None:
        for _ in range(n):
            two.step(next(pairs))

    def steps_of_strangers() -> None:
        for stranger in strangers:
            stranger.begin(n)
        for stranger in strangers:
            stranger.end()

    turns = steps_of_one, steps_of_two, steps_of_strangers
    for turn in turns:
        turn()  # kernels load
    alone, together, apart = np.median(
        [[seconds(turn) for turn in turns] for _ in range(_ROUNDS)], axis=0
    )
    for one in ones:
        one.close()
    two.close()
    for stranger in strangers:
        stranger.close()
    gains = alone / together, alone / apart
    return {name: (float(g), "ratio") for name, g in zip(_names(what), gains, strict=True)}


class _Stranger:
    """A process that steps the k-th world, on the k-th processor."""

    def __init__(self, sensors: list[str], k: int) -> None:
        self._pipe, its_end = multiprocessing.Pipe()
        self._process = multiprocessing.Process(
            target=_step_alone, args=(sensors, k, processors(k, 2), its_end), daemon=True
        )
        self._process.start()

    def begin(self, n: int) -> None:
        self._pipe.send(n)

    def end(self) -> None:
        self._pipe.recv()

    def close(self) -> None:
        self._pipe.send(0)
        self._process.join()


def _step_alone(sensors: list[str], seed: int, share: frozenset[int], pipe: Connection) -> None:
    with keeping_to(share):
        env = gym.make(_ID, sensors=sensors)
        env.reset(seed=seed)
        actions = cycle(curves())
        while n := pipe.recv():
            for _ in range(n):
                env.step(next(actions))
            pipe.send(n)
        env.close()
