"""Drives through the paper's course, and what estimators made of them."""

from collections.abc import Callable, Mapping
from functools import cache
from typing import Any

import gymnasium as gym
import numpy as np

from grouser.estimators.base import PoseEstimator
from grouser.estimators.evaluation.comparison import Run, compare_open_loop
from grouser.geometry import Array
from grouser.rig import Rig
from grouser.scripts.plane_source import Plane
from grouser.scripts.reproduction.yan.paper import OBSERVING_EVERY

_LONG = 100_000
"""Steps; the course is shorter."""


def line_world(world: str, **options: Any) -> gym.Env[Any, Any]:
    """The environment, as the paper has it unless otherwise said."""
    return gym.make(
        "grouser/LineWorld-v0", world=world, **({"observe_every": OBSERVING_EVERY} | options)
    )


@cache
def course(world: str) -> tuple[Array, ...]:
    """The actions of the course, which noise does not change."""
    drive, actions = Plane(world).drive(_LONG), list[Array]()
    while (action := drive(len(actions))) is not None:
        actions.append(action.astype(np.float32))
    return tuple(actions)


def rig_of(env: gym.Env[Any, Any]) -> Rig:
    """What estimators know of the vehicle."""
    rig: Rig = env.get_wrapper_attr("rig")
    return rig


def watch(
    env: gym.Env[Any, Any],
    world: str,
    estimators: Mapping[str, PoseEstimator],
    seed: int,
    *,
    on_step: Callable[[], None] = lambda: None,
) -> list[Run]:
    """One drive, of which all estimators see the same bits; `on_step` is called after each step."""
    actions = course(world)
    return compare_open_loop(
        env, estimators, lambda step: actions[step], seed=seed, steps=len(actions), on_step=on_step
    )
