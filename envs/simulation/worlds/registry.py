"""Worlds by name: seeded generators, and what is guaranteed of every world."""

from collections.abc import Callable, Iterable, Mapping
from numbers import Real
from typing import NamedTuple

import numpy as np

from grouser.checks import did_you_mean
from grouser.envs.simulation.world import World
from grouser.envs.simulation.worlds.corridor import corridor
from grouser.envs.simulation.worlds.forest import forest
from grouser.envs.simulation.worlds.garden import garden
from grouser.envs.simulation.worlds.goals import FEWEST_GOALS, with_goals
from grouser.envs.simulation.worlds.orchard import orchard
from grouser.envs.simulation.worlds.parking_lot import parking_lot
from grouser.envs.simulation.worlds.placement import NoPlace
from grouser.envs.simulation.worlds.randomization import (
    RANDOMIZABLE,
    clutter_factor,
    randomization_strengths,
    randomized,
)
from grouser.envs.simulation.worlds.room import room
from grouser.envs.simulation.worlds.rubble import rubble
from grouser.envs.simulation.worlds.terrain import covered, require_terrain
from grouser.envs.simulation.worlds.yard import depot, yard

Generator = Callable[[np.random.Generator, float, float], World]
"""Makes a world, without goals yet, of a generator of numbers, a difficulty in [0, 1] and a factor
on the number of obstacles; NoPlace if by chance it cannot."""


class _Kind(NamedTuple):
    generate: Generator
    description: str


_KINDS: dict[str, _Kind] = {
    "yard": _Kind(yard, "a walled gravel yard, strewn with boxes around a clear place"),
    "depot": _Kind(
        depot, "the yard with boxes of 0.6 m and more, so that a lidar sees all of them"
    ),
    "room": _Kind(room, "two furnished rooms joined by a door with a sill, in lamplight"),
    "corridor": _Kind(corridor, "passages around blocks and rooms, always with a loop"),
    "parking-lot": _Kind(parking_lot, "open asphalt with marked bays, far from cars and walls"),
    "garden": _Kind(garden, "cement paths through grass, beds, hedges, trees, gentle slopes"),
    "orchard": _Kind(orchard, "rows of trees on gently uneven grass, puddles of mud, an evening"),
    "forest": _Kind(forest, "random trees on hills, with logs, roots and rocks, in failing light"),
    "rubble": _Kind(rubble, "rough ground under slabs of all heights, broken blocks and ruins"),
}
_ATTEMPTS = 20


def world_names() -> list[str]:
    """Names that `make_world` accepts."""
    return sorted(_KINDS)


def world_descriptions() -> dict[str, str]:
    """One line about every kind of world, by name."""
    return {name: kind.description for name, kind in _KINDS.items()}


def make_world(
    name: str,
    rng: np.random.Generator,
    *,
    difficulty: float = 0.5,
    terrain: str | None = None,
    randomize: str | Iterable[str] | Mapping[str, float] = (),
) -> World:
    """A new world of the named kind, with at least five goals that the robot can drive to.

    Args:
        rng: the same state gives the same world.
        difficulty: from 0 to 1; each kind says what it does.
        terrain: a material that the ground shall be of everywhere, or "mixed": patches of all
            materials; None leaves it to the kind.
        randomize: which of RANDOMIZABLE to vary, or how much of each: a mapping to [0, 1]. One
            more or less changes nothing else of the world, except that with another clutter things
            stand elsewhere.

    Raises:
        ValueError: an unknown name, terrain or kind of randomisation (the message lists those
            there are), or a number outside [0, 1].
        RuntimeError: the generator failed many times over.
    """
    require_arguments(name, difficulty=difficulty, terrain=terrain, randomize=randomize)
    strengths = randomization_strengths(randomize)
    terrain_rng, *others = rng.spawn(1 + len(RANDOMIZABLE))
    rngs = dict(zip(RANDOMIZABLE, others, strict=True))
    clutter = clutter_factor(rngs["clutter"], strengths["clutter"])
    world = _valid_world(name, rng, difficulty, clutter)
    return randomized(covered(world, terrain, terrain_rng), strengths, rngs)


def require_arguments(
    name: str,
    *,
    difficulty: float,
    terrain: str | None,
    randomize: str | Iterable[str] | Mapping[str, float],
) -> None:
    """Raise where `make_world` would refuse these arguments."""
    _require_known(name)
    _require_difficulty(difficulty)
    require_terrain(terrain)
    randomization_strengths(randomize)


def _valid_world(name: str, rng: np.random.Generator, difficulty: float, clutter: float) -> World:
    """A world with goals; chance is given several tries to make one."""
    for _ in range(_ATTEMPTS):
        try:
            world = with_goals(_KINDS[name].generate(rng, difficulty, clutter), rng)
        except NoPlace:
            continue
        if world is not None:
            return world
    raise RuntimeError(
        f"{_ATTEMPTS} tries made no {name!r} of difficulty {difficulty} with {FEWEST_GOALS} goals "
        "in reach of its start; lower the difficulty, or do not randomise clutter"
    )


def _require_known(name: str) -> None:
    if name not in _KINDS:
        hint = did_you_mean(name, _KINDS)
        raise ValueError(f"no world is named {name!r}; {hint}known: {', '.join(world_names())}")


def _require_difficulty(difficulty: float) -> None:
    if not (isinstance(difficulty, Real) and 0 <= difficulty <= 1):
        raise ValueError(f"difficulty must be in [0, 1], from easy to hard, got {difficulty!r}")
