"""What the environments of a vector show at a step, in one piece of memory that processes share."""

from collections.abc import Iterator, Mapping
from math import prod
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

_ALIGNMENT = 64
"""Bytes: a line of the processor's cache."""

Field = tuple[Any, tuple[int, ...]]
"""Type and shape of what one environment shows under a name."""

_OUTCOME: Mapping[str, Field] = {
    "reward": (np.float64, ()),
    "terminated": (np.bool_, ()),
    "truncated": (np.bool_, ()),
}


class _Place(NamedTuple):
    """Of one array."""

    name: str
    shape: tuple[int, ...]
    dtype: np.dtype[Any]
    start: int
    end: int


class PageFormat:
    """What is on a page, and where.

    Args:
        observation: fields by key.
        info: fields by key, of what an environment's info has at every step.
        num_envs: rows of every array.
    """

    def __init__(
        self, observation: Mapping[str, Field], info: Mapping[str, Field], num_envs: int
    ) -> None:
        self.num_envs = num_envs
        self.having = [f"_{key}" for key in info]
        """Names of Gymnasium's flags of who has an info."""
        self._outcome = list(_places(_OUTCOME, num_envs, 0))
        self._info = list(_places(info, num_envs, self._outcome[-1].end))
        self.n_bytes_before_observations = [*self._outcome, *self._info][-1].end
        self._observation = list(_places(observation, num_envs, self.n_bytes_before_observations))
        self.n_bytes = [*self._outcome, *self._info, *self._observation][-1].end

    def shared(self, memory: Any) -> "Page":
        """The page in memory of `multiprocessing`, n_bytes long."""
        shown = np.frombuffer(memory, dtype=np.uint8)
        return self.on(shown, shown)

    def on(self, memory: NDArray[np.uint8], observations: NDArray[np.uint8]) -> "Page":
        """The page in a piece of memory, with its observations in that piece or in another."""
        return Page(
            self,
            memory,
            _arrays(self._observation, observations),
            _arrays(self._info, memory),
            **_arrays(self._outcome, memory),
        )


class Page(NamedTuple):
    """Arrays of which the first axis is the environment."""

    format: PageFormat
    memory: NDArray[np.uint8]
    observation: dict[str, NDArray[Any]]
    info: dict[str, NDArray[Any]]
    reward: NDArray[np.float64]
    terminated: NDArray[np.bool_]
    truncated: NDArray[np.bool_]

    def copied(self, *, observations: bool) -> "Page":
        """The same in memory of its own; the observations only if wanted."""
        n = self.format.n_bytes if observations else self.format.n_bytes_before_observations
        memory = self.memory[:n].copy()
        return self.format.on(memory, memory if observations else self.memory)

    def write_observation(self, index: int, observation: Mapping[str, Any]) -> None:
        """Note what an environment shows."""
        for key, rows in self.observation.items():
            rows[index] = observation[key]

    def write_info(self, index: int, info: Mapping[str, Any]) -> bool:
        """Note an environment's info, if it has nothing but what is on the page; whether it has."""
        if info.keys() != self.info.keys():
            return False
        for key, rows in self.info.items():
            rows[index] = info[key]
        return True

    def info_of(self, index: int) -> dict[str, Any]:
        """The info that an environment noted."""
        return {
            key: rows[index].copy() if rows.ndim > 1 else rows[index].item()
            for key, rows in self.info.items()
        }

    def infos(self) -> dict[str, Any]:
        """The infos of all environments as Gymnasium batches them: beside each, who has it."""
        having = np.ones((len(self.info), self.format.num_envs), dtype=np.bool_)
        return {**self.info, **dict(zip(self.format.having, having, strict=True))}


def _places(fields: Mapping[str, Field], num_envs: int, start: int) -> Iterator[_Place]:
    for name, (dtype, shape) in fields.items():
        dtype = np.dtype(dtype)
        n_bytes = num_envs * prod(shape) * dtype.itemsize
        end = start + -(-n_bytes // _ALIGNMENT) * _ALIGNMENT
        yield _Place(name, (num_envs, *shape), dtype, start, end)
        start = end


def _arrays(places: list[_Place], memory: NDArray[np.uint8]) -> dict[str, NDArray[Any]]:
    return {
        name: np.ndarray(shape, dtype, memory, start) for name, shape, dtype, start, _ in places
    }
