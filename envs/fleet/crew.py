"""Some environments of a vector, stepped one after another in one process."""

from collections.abc import Callable, Sequence
from typing import Any

import gymnasium as gym
from gymnasium.vector import AutoresetMode

from grouser.envs.fleet.page import Page

Maker = Callable[[], gym.Env[Any, Any]]
Info = dict[str, Any] | None
"""None where it is on the page."""


class Crew:
    """Environments that note on a page what they show.

    Args:
        makers: of the environments.
        first: index of the first of them in the vector; the others follow.
        page: of the vector.
        mode: when an environment whose episode ended is reset.
    """

    def __init__(
        self, makers: Sequence[Maker], first: int, page: Page, mode: AutoresetMode
    ) -> None:
        self._page, self._first, self._mode = page, first, mode
        self._envs = [make() for make in makers]
        self._ended = [False] * len(makers)

    def reset(
        self, seeds: Sequence[int | None], options: dict[str, Any] | None, mask: Sequence[bool]
    ) -> list[Info]:
        """Reset those that the mask (k,) names; the infos, empty of those that it does not."""
        return [
            self._reset(k, seed, options) if named else {}
            for k, (seed, named) in enumerate(zip(seeds, mask, strict=True))
        ]

    def step(self, actions: Sequence[Any]) -> list[Info]:
        """Step each with its action, or reset it; the infos."""
        return [self._step(k, action) for k, action in enumerate(actions)]

    def call(self, name: str, args: Sequence[Any], kwargs: dict[str, Any]) -> list[Any]:
        """What each has, or gives when it is called, under a name."""
        return [_called(env.get_wrapper_attr(name), args, kwargs) for env in self._envs]

    def set_attr(self, name: str, values: Sequence[Any]) -> list[None]:
        """Give each its value of an attribute."""
        for env, value in zip(self._envs, values, strict=True):
            env.set_wrapper_attr(name, value)
        return [None] * len(values)

    def close(self) -> None:
        """Close all of them."""
        for env in self._envs:
            env.close()

    def _reset(self, k: int, seed: int | None, options: dict[str, Any] | None) -> Info:
        observation, info = self._envs[k].reset(seed=seed, options=options)
        self._ended[k] = False
        self._page.write_observation(self._first + k, observation)
        return self._noted(k, info)

    def _step(self, k: int, action: Any) -> Info:
        if self._ended[k] and self._mode is AutoresetMode.NEXT_STEP:
            info = self._reset(k, None, None)
            self._outcome(k, 0.0, False, False)
            return info
        observation, reward, terminated, truncated, info = self._envs[k].step(action)
        self._outcome(k, float(reward), terminated, truncated)
        if self._ended[k] and self._mode is AutoresetMode.SAME_STEP:
            final = {"final_info": info, "final_obs": observation}
            observation, info = self._envs[k].reset()
            info = final | info
        self._page.write_observation(self._first + k, observation)
        return self._noted(k, info)

    def _outcome(self, k: int, reward: float, terminated: bool, truncated: bool) -> None:
        page, index = self._page, self._first + k
        page.reward[index], page.terminated[index] = reward, terminated
        page.truncated[index] = truncated
        self._ended[k] = terminated or truncated

    def _noted(self, k: int, info: dict[str, Any]) -> Info:
        return None if self._page.write_info(self._first + k, info) else info


def _called(attribute: Any, args: Sequence[Any], kwargs: dict[str, Any]) -> Any:
    return attribute(*args, **kwargs) if callable(attribute) else attribute
