"""All that an episode of the tracked robot depends on from here on."""

import copy
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from grouser.envs.simulation.motion import Motion
from grouser.envs.simulation.world import World
from grouser.geometry import Array


@dataclass(frozen=True, slots=True, eq=False)
class SavedGenerator:
    """A generator as a value. NumPy before 2 pickles and copies generators without their seed
    sequence, of which their children are spawned: worlds and noise would then be any."""

    state: Any
    """Of the bit generator."""
    seeds: np.random.SeedSequence
    """How many children were spawned of it included."""

    @staticmethod
    def of(rng: np.random.Generator) -> "SavedGenerator":
        """A generator as it is now."""
        seeds = rng.bit_generator.seed_seq
        assert isinstance(seeds, np.random.SeedSequence)
        return SavedGenerator(rng.bit_generator.state, copy.deepcopy(seeds))

    def restored(self) -> np.random.Generator:
        """A generator that draws and spawns what that one did from there."""
        bits = np.random.PCG64(copy.deepcopy(self.seeds))
        bits.state = self.state
        return np.random.Generator(bits)


@dataclass(frozen=True, slots=True, eq=False)
class TrackedRobotState:
    """A moment of an episode; it can be pickled, and goes with one kind of environment only."""

    settings: Mapping[str, Any]
    """The arguments of the environment that matter to an episode."""
    world: World
    n_steps: int
    motion: Motion
    """The last one."""
    start: Array
    """(4, 4) T_world_base at the start."""
    robot: Any
    """Body, tracks and motors."""
    sensors: Any
    """Generators, counters, biases, readings that are on their way."""
    generator: SavedGenerator
    """The environment's own, of which the next world will be made."""

    def require_settings(self, settings: Mapping[str, Any]) -> None:
        """Raise where an environment has other settings.

        Raises:
            ValueError: it has; the message says which, and what both are.
        """
        differing = [name for name in settings if settings[name] != self.settings.get(name)]
        if differing:
            words = "; ".join(
                f"{name} {self.settings.get(name)!r}, here {settings[name]!r}" for name in differing
            )
            raise ValueError(
                f"this state was saved by an environment with other settings: {words}; "
                "restore it into one that was made with the same arguments"
            )
