"""Worlds by name: seeded generators."""

import difflib
from collections.abc import Callable

import numpy as np

from grouser.envs.simulation.world import World
from grouser.envs.simulation.worlds.yard import yard

_GENERATORS: dict[str, Callable[[np.random.Generator], World]] = {"yard": yard}


def world_names() -> list[str]:
    """Names that `make_world` accepts."""
    return sorted(_GENERATORS)


def make_world(name: str, rng: np.random.Generator) -> World:
    """A new world of the named kind.

    Raises:
        ValueError: no kind of world has that name; the message lists those there are.
    """
    if name not in _GENERATORS:
        near = difflib.get_close_matches(str(name), _GENERATORS, n=1)
        hint = f"did you mean {near[0]!r}? " if near else ""
        raise ValueError(f"no world is named {name!r}; {hint}known: {', '.join(world_names())}")
    return _GENERATORS[name](rng)
