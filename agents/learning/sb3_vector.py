"""GoalNav in a few processes, as Stable-Baselines3 wants its environments."""

from collections.abc import Sequence
from typing import Any

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray
from stable_baselines3.common.vec_env import VecEnv

from grouser.agents.learning.terse_vector import terse_vector
from grouser.envs.fleet.crew import Maker


class Sb3Vector(VecEnv):
    """Environments in as many processes as there are processors.

    Args:
        makers: of the environments.
    """

    def __init__(self, makers: Sequence[Maker]) -> None:
        self._vector = terse_vector(makers)
        self._next_seeds: list[int] | None = None
        self._returns, self._lengths = np.zeros(len(makers)), np.zeros(len(makers), dtype=int)
        vector = self._vector
        super().__init__(len(makers), vector.single_observation_space, vector.single_action_space)

    def reset(self) -> dict[str, NDArray[Any]]:
        """Reset all; after `seed`, with seeds."""
        seeds, self._next_seeds = self._next_seeds, None
        observation, _ = self._vector.reset(seed=seeds)
        self._returns[:], self._lengths[:] = 0, 0
        return observation

    def step_async(self, actions: NDArray[Any]) -> None:
        """Begin a step of all."""
        self._vector.step_async(actions)

    def step_wait(self) -> Any:
        """End it: observations, rewards, whether episodes ended, infos."""
        observation, reward, terminated, truncated, batched = self._vector.step_wait()
        ended = terminated | truncated
        self._returns += reward
        self._lengths += 1
        infos: list[dict[str, Any]] = [{} for _ in range(self.num_envs)]
        for k in np.flatnonzero(ended):
            infos[k] = {
                "terminal_observation": batched["final_obs"][k],
                "TimeLimit.truncated": bool(truncated[k] and not terminated[k]),
                "is_success": bool(batched["final_info"]["is_success"][k]),
                "episode": {"r": float(self._returns[k]), "l": int(self._lengths[k])},
            }
        self._returns[ended], self._lengths[ended] = 0, 0
        return observation, reward.astype(np.float32), ended, infos

    def close(self) -> None:
        """End the processes."""
        self._vector.close()

    def seed(self, seed: int | None = None) -> list[int | None]:
        """Seed the next reset: the n-th environment with seed + n."""
        if seed is None:
            return [None] * self.num_envs
        self._next_seeds = [seed + k for k in range(self.num_envs)]
        return [*self._next_seeds]

    def get_attr(self, attr_name: str, indices: Any = None) -> list[Any]:
        """An attribute of some environments."""
        values = self._vector.get_attr(attr_name)
        return [values[k] for k in self._get_indices(indices)]

    def set_attr(self, attr_name: str, value: Any, indices: Any = None) -> None:
        """Give an attribute to all environments.

        Raises:
            ValueError: only some of them were named.
        """
        self._require_all(indices)
        self._vector.set_attr(attr_name, value)

    def env_method(
        self, method_name: str, *args: Any, indices: Any = None, **kwargs: Any
    ) -> list[Any]:
        """Call a method of all environments.

        Raises:
            ValueError: only some of them were named.
        """
        self._require_all(indices)
        return list(self._vector.call(method_name, *args, **kwargs))

    def env_is_wrapped(self, wrapper_class: type[gym.Wrapper[Any, Any, Any, Any]],
                       indices: Any = None) -> list[bool]:  # fmt: skip
        """Stable-Baselines3 asks for its Monitor, whose work is done here: no."""
        return [False for _ in self._get_indices(indices)]

    def _require_all(self, indices: Any) -> None:
        if indices is not None and len(list(self._get_indices(indices))) != self.num_envs:
            raise ValueError("this vector does that for all of its environments, not for some")
