"""Another ground under the same world: one material everywhere, or patches of all."""

from dataclasses import replace

import numpy as np

from grouser.envs.simulation.ground import Ground
from grouser.envs.simulation.materials import MATERIALS, material_index
from grouser.envs.simulation.world import World
from grouser.envs.simulation.worlds.noise import smooth_noise
from grouser.envs.simulation.worlds.relief import CELL, node_positions

MIXED = "mixed"
"""The terrain of patches of all materials."""

_PATCH = (3.0, 9.0)  # wavelengths, m: patches are about a third as wide


def require_terrain(name: str | None) -> None:
    """ValueError if there is no such terrain."""
    if name is None or name == MIXED:
        return
    try:
        material_index(name)
    except ValueError as error:
        raise ValueError(f"{error}; or {MIXED!r}: patches of all") from None


def covered(world: World, terrain: str | None, rng: np.random.Generator) -> World:
    """The world on another terrain: a material, MIXED, or its own for None."""
    if terrain is None:
        return world
    if terrain == MIXED:
        return replace(world, ground=_mixed(world.ground, rng))
    return replace(world, ground=world.ground.made_of(terrain))


def _mixed(ground: Ground, rng: np.random.Generator) -> Ground:
    """Every cell is of the material whose smooth noise is the highest there."""
    ground = _in_cells(ground)
    shape, (shortest, longest) = ground.material.shape, _PATCH
    fields = [
        smooth_noise(rng, shape, ground.cell, shortest=shortest, longest=longest) for _ in MATERIALS
    ]
    return replace(ground, material=np.argmax(fields, axis=0))


def _in_cells(ground: Ground) -> Ground:
    """The same heights and materials in cells small enough for patches."""
    times = int(np.ceil(ground.cell / CELL))
    if times == 1:
        return ground
    material = np.repeat(np.repeat(ground.material, times, axis=0), times, axis=1)
    shape = (material.shape[0] + 1, material.shape[1] + 1)
    fine = replace(ground, material=material, heights=np.zeros(shape), cell=ground.cell / times)
    return replace(fine, heights=ground.height(node_positions(fine)))
