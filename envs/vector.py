"""Many robots at once, each in a process of its own: what `gym.make_vec` makes by default.

A step lasts a few milliseconds, which is short for a scheduler: left alone, it often keeps two busy
workers on one processor and leaves another idle. So the processors are dealt out among the workers.
"""

import os
from functools import partial
from typing import Any

import gymnasium as gym
from gymnasium.vector import AsyncVectorEnv

_ID = "grouser/TrackedRobot-v0"


def tracked_robots(num_envs: int, *, context: str | None = None, **options: Any) -> AsyncVectorEnv:
    """Tracked robots in processes of their own.

    Args:
        num_envs: how many.
        context: how processes start, as multiprocessing has it: "fork", "spawn" or "forkserver".
        options: those of `TrackedRobotEnv`.
    """
    makers = [
        partial(_make, os.getpid(), processors(index, num_envs), options)
        for index in range(num_envs)
    ]
    return AsyncVectorEnv(makers, context=context)


def processors(index: int, of: int) -> frozenset[int]:
    """Those of this process's processors that one of so many workers gets: a fair share, or one of
    them where there are more workers; none where the system does not let processes choose."""
    if not hasattr(os, "sched_getaffinity"):  # macOS, Windows
        return frozenset()
    own = sorted(os.sched_getaffinity(0))
    if of >= len(own):
        return frozenset({own[index % len(own)]})
    return frozenset(own[index * len(own) // of : (index + 1) * len(own) // of])


def _make(parent: int, share: frozenset[int], options: dict[str, Any]) -> gym.Env[Any, Any]:
    """An environment; the vector asks its own process for one, too, which keeps all it has."""
    if share and os.getpid() != parent:
        os.sched_setaffinity(0, share)
    return gym.make(_ID, **options)
