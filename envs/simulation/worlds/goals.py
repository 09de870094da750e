"""Goals: places far apart that the robot can drive to."""

from dataclasses import replace
from typing import Final

import numpy as np

from grouser.envs.simulation.world import World
from grouser.envs.simulation.worlds.reachability import free_space, reachable
from grouser.geometry import Array

FEWEST_GOALS: Final = 5
"""A world with fewer is not valid."""

GOAL_SPACING: Final = 3.0
"""Goals are at least this far from each other and from the start, m."""

_MOST_GOALS = 8
_CANDIDATES = 400


def with_goals(world: World, rng: np.random.Generator) -> World | None:
    """The world with 5 to 8 goals; None if the robot cannot reach that many from its start."""
    places = reachable(free_space(world), world.start[:2]).points()
    if len(places) == 0:
        return None
    goals = _spread(places[rng.integers(0, len(places), _CANDIDATES)], world.start[:2])
    return replace(world, goals=goals) if len(goals) >= FEWEST_GOALS else None


def _spread(candidates: Array, start: Array) -> Array:
    """The first (at most 8) candidates (n, 2) that keep their distance from all before."""
    chosen = [start]
    for candidate in candidates:
        if np.linalg.norm(candidate - chosen, axis=-1).min() >= GOAL_SPACING:
            chosen.append(candidate)
        if len(chosen) > _MOST_GOALS:
            break
    return np.array(chosen[1:]).reshape(-1, 2)
