"""Estimators side by side on one environment: what they said, what was true, how long it took."""

import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from itertools import count
from typing import Any

import gymnasium as gym
import numpy as np

from grouser.estimators.base import Observation, PoseEstimate, PoseEstimator, readable
from grouser.estimators.evaluation.smoother import Smoother
from grouser.estimators.random_stream import estimator_rng
from grouser.geometry import Array

OpenLoop = Callable[[int], Array | None]
"""The action (2,) of each step, whatever any estimator says, or None to end the run."""

ClosedLoop = Callable[[PoseEstimate], Array | None]
"""The action (2,) for an estimate, or None to end the run."""

OnStep = Callable[[], None]
"""Called after every step, for a progress bar."""

_Frame = tuple[Observation, Mapping[str, Any]]


@dataclass(frozen=True, slots=True)
class Run:
    """One estimator over one rollout of N frames, the first being that of the reset."""

    estimator: str
    seed: int
    stamps: Array
    """(N,) s"""
    estimates: tuple[PoseEstimate, ...]
    """N"""
    update_ms: Array
    """(N - 1,) time of each `update` alone."""
    true_poses: Array | None
    """(N, 3) in the frame of the start; None for a recording without truth."""
    true_poses_3d: Array | None
    """(N, 4, 4) T_start_base"""
    smoothed: Array | None = None
    """(N, 3) the way as the estimator knew it in the end, of those that correct earlier poses."""


def compare_open_loop(
    env: gym.Env[Any, Any],
    estimators: Mapping[str, PoseEstimator],
    drive: OpenLoop,
    *,
    seed: int,
    steps: int | None = None,
    on_step: OnStep = lambda: None,
) -> list[Run]:
    """Drive once and let all estimators look on: every one of them sees the same bits.

    The rollout ends after `steps`, with the drive or with the episode, whichever comes first.

    Raises:
        ValueError: the environment does not give what an estimator requires.
    """
    watchers = [_Watcher(name, estimator, seed) for name, estimator in estimators.items()]
    for frame in _frames(env, drive, seed=seed, steps=steps, on_step=on_step):
        for watcher in watchers:
            watcher.look(frame)
    return [watcher.run() for watcher in watchers]


def compare_closed_loop(
    env: gym.Env[Any, Any],
    name: str,
    estimator: PoseEstimator,
    driver: ClosedLoop,
    *,
    seed: int,
    steps: int | None = None,
    on_step: OnStep = lambda: None,
) -> Run:
    """Drive on the estimate: an estimator's errors change where the robot goes.

    Raises:
        ValueError: the environment does not give what the estimator requires.
    """
    watcher = _Watcher(name, estimator, seed)
    for frame in _frames(
        env, lambda _: driver(watcher.latest), seed=seed, steps=steps, on_step=on_step
    ):
        watcher.look(frame)
    return watcher.run()


def _frames(
    env: gym.Env[Any, Any],
    act: Callable[[int], Array | None],
    *,
    seed: int,
    steps: int | None,
    on_step: OnStep,
) -> Iterator[_Frame]:
    observation, info = env.reset(seed=seed)
    yield observation, info
    for step in count() if steps is None else range(steps):
        action = act(step)
        if action is None:
            return
        allowed = np.asarray(action, dtype=env.action_space.dtype)
        observation, _, terminated, truncated, info = env.step(allowed)
        yield observation, info
        on_step()
        if terminated or truncated:
            return


class _Watcher:
    """Shows an estimator every frame and keeps the record of it."""

    def __init__(self, name: str, estimator: PoseEstimator, seed: int) -> None:
        self._name, self._estimator, self._seed = name, estimator, seed
        self._estimates: list[PoseEstimate] = []
        self._update_ms: list[float] = []
        self._stamps: list[float] = []
        self._truth: list[tuple[Array, Array] | None] = []

    @property
    def latest(self) -> PoseEstimate:
        return self._estimates[-1]

    def look(self, frame: _Frame) -> None:
        observation, info = frame
        # A copy, so that an estimator that writes into what it reads cannot spoil it for the next.
        seen = {k: v.copy() for k, v in readable(self._estimator, observation, info).items()}
        if not self._estimates:
            estimate = self._estimator.reset(seen, rng=estimator_rng(self._seed))
        else:
            began = time.perf_counter()
            estimate = self._estimator.update(seen)
            self._update_ms.append(1e3 * (time.perf_counter() - began))
        self._estimates.append(estimate)
        self._stamps.append(float(observation["stamp"][0]))
        self._truth.append(_true_pose(info))

    def run(self) -> Run:
        truth = [pair for pair in self._truth if pair is not None]
        complete = len(truth) == len(self._truth)
        return Run(
            estimator=self._name,
            seed=self._seed,
            stamps=np.array(self._stamps),
            estimates=tuple(self._estimates),
            update_ms=np.array(self._update_ms),
            true_poses=np.array([pose for pose, _ in truth]) if complete else None,
            true_poses_3d=np.array([T for _, T in truth]) if complete else None,
            smoothed=self._smoothed(),
        )

    def _smoothed(self) -> Array | None:
        return self._estimator.trajectory if isinstance(self._estimator, Smoother) else None


def _true_pose(info: Mapping[str, Any]) -> tuple[Array, Array] | None:
    if "true_pose" not in info:
        return None
    return np.array(info["true_pose"], float), np.array(info["true_pose_3d"], float)
