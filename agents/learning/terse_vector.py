"""GoalNav in a few processes, without what training does not ask for."""

from collections.abc import Sequence
from functools import partial
from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium.vector import AutoresetMode

from grouser.envs.fleet.crew import Maker
from grouser.envs.fleet.page import Field
from grouser.envs.fleet.robot_vector import RobotVectorEnv

_INFO: dict[str, Field] = {"is_success": (np.bool_, ()), "collision": (np.bool_, ())}
"""What training asks of every step's info; all of it would cost more than the step."""


class _Terse(gym.Wrapper[Any, Any, Any, Any]):
    """Leaves all but _INFO out of the infos."""

    def reset(self, **kwargs: Any) -> tuple[Any, dict[str, Any]]:
        observation, info = self.env.reset(**kwargs)
        return observation, {key: info[key] for key in _INFO}

    def step(self, action: Any) -> tuple[Any, Any, bool, bool, dict[str, Any]]:
        observation, reward, terminated, truncated, info = self.env.step(action)
        return observation, reward, terminated, truncated, {key: info[key] for key in _INFO}


def _terse(make: Maker) -> gym.Env[Any, Any]:
    return _Terse(make())


def terse_vector(makers: Sequence[Maker]) -> RobotVectorEnv:
    """Environments in as many processes as there are processors; an episode that ends is followed
    by the next in the same step."""
    return RobotVectorEnv(
        [partial(_terse, make) for make in makers],
        info=_INFO,
        autoreset_mode=AutoresetMode.SAME_STEP,
    )
