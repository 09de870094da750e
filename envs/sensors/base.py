"""What every simulated sensor is: an ideal measurement of the true motion, then its own noise."""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import Any

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from grouser.envs.simulation.motion import Motion
from grouser.envs.simulation.world import World

Reading = dict[str, NDArray[Any]]


class Sensor(ABC):
    """Gives one or more keys of the observation; every reading is new memory."""

    @property
    @abstractmethod
    def spaces(self) -> dict[str, spaces.Box]:
        """Key and bounded space of everything that it reads."""

    @abstractmethod
    def enter(self, world: World, rngs: Mapping[str, np.random.Generator]) -> None:
        """Start anew in a world, with a generator for each key of `spaces` (and maybe others)."""

    @abstractmethod
    def read(self, motion: Motion) -> Reading:
        """The observation after a motion, which is new since the last one."""

    def close(self) -> None:  # noqa: B027 - most sensors hold nothing
        """Free what it holds; a second call does nothing."""
