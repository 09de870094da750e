"""How the worlds of an environment are made: with the same arguments at every reset."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

import numpy as np

from grouser.envs.simulation.world import World
from grouser.envs.simulation.worlds.randomization import randomization_strengths
from grouser.envs.simulation.worlds.registry import make_world, require_arguments


@dataclass(frozen=True, slots=True)
class WorldRecipe:
    """The arguments of `make_world`, checked once.

    Raises:
        ValueError: as `make_world` does.
    """

    name: str
    difficulty: float = 0.5
    terrain: str | None = None
    randomize: str | Iterable[str] | Mapping[str, float] = field(default=())

    def __post_init__(self) -> None:
        strengths = randomization_strengths(self.randomize)  # an iterator may be read only once
        object.__setattr__(self, "randomize", strengths)
        require_arguments(
            self.name,
            difficulty=self.difficulty,
            terrain=self.terrain,
            randomize=strengths,
        )

    def make(self, rng: np.random.Generator) -> World:
        """A new world."""
        return make_world(
            self.name,
            rng,
            difficulty=self.difficulty,
            terrain=self.terrain,
            randomize=self.randomize,
        )

    def noise_scale(self, rng: np.random.Generator) -> float:
        """What an episode's sensor noises are multiplied by: at most 2, at least 1/2."""
        strength = randomization_strengths(self.randomize)["sensor_noise"]
        return float(2 ** (strength * rng.uniform(-1, 1)))
