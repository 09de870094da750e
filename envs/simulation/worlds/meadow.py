"""Hilly grass with puddles of mud: the ground of forest and orchard."""

from collections.abc import Sequence

import numpy as np

from grouser.envs.simulation.ground import Ground
from grouser.envs.simulation.worlds.noise import patches
from grouser.envs.simulation.worlds.relief import Waves, level_ground, with_hills, with_material
from grouser.geometry import Array


def meadow(
    rng: np.random.Generator,
    reach: tuple[float, float],
    start: Array,
    *,
    mud: float,
    steepest: float,
    waves: Sequence[Waves],
) -> Ground:
    """Grass over the rectangle of half sides `reach` [m], level at the start.

    Args:
        mud: share of the ground that puddles cover.
        steepest: slope, rad.
        waves: of the hills.
    """
    ground = level_ground(reach, "grass")
    puddles = patches(rng, ground.material.shape, ground.cell, share=mud, size=2.0)
    return with_hills(
        rng,
        with_material(ground, puddles, "mud"),
        steepest=steepest,
        waves=waves,
        level_at=start[:2],
        level_radius=1.0,
    )
