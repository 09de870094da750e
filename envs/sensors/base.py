"""What every simulated sensor is: an ideal model of the true motion, then noise, then faults."""

import pickle
from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from grouser.envs.simulation.motion import Motion
from grouser.envs.simulation.world import World

Reading = dict[str, NDArray[Any]]


class Sensor(ABC):
    """Gives one or more keys of the observation; every reading is new memory.

    The order of calls: `enter` once an episode, then after every motion (that of standing at the
    start is the first) `advance`, and `read` when a reading is due.

    Everything that changes within an episode is in `_memory`, which can be pickled.
    """

    adds_up: ClassVar[bool] = False
    """Whether a reading is what happened since the last one, and so must not be shown twice."""

    _memory: Any = None

    @property
    @abstractmethod
    def spaces(self) -> dict[str, spaces.Box]:
        """Key and bounded space of everything that it reads."""

    @abstractmethod
    def enter(self, world: World, rngs: Mapping[str, np.random.Generator]) -> None:
        """Start anew in a world, with a generator for each key of the observation."""

    def advance(self, motion: Motion) -> None:  # noqa: B027 - most sensors measure an instant
        """Take in one more control step."""

    @abstractmethod
    def read(self, motion: Motion, amounts: Mapping[str, float]) -> Reading:
        """What is measured at the end of a motion, with these amounts of every effect."""

    def save(self) -> bytes:
        """Everything that changes within an episode."""
        return pickle.dumps(self._memory)

    def restore(self, saved: bytes) -> None:
        """Go on, bit for bit, from where `save` was called, in a sensor that entered that world."""
        self._memory = pickle.loads(saved)

    def close(self) -> None:  # noqa: B027 - most sensors hold nothing
        """Free what it holds; a second call does nothing."""
