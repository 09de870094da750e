"""What grounds are made of, as a track feels it and as a camera sees it."""

from dataclasses import dataclass

import numpy as np

from grouser.checks import did_you_mean
from grouser.geometry import Array

TEXTURES = (
    "gravel",
    "brick",
    "plaster",
    "pebbles",
    "blocks",
    "concrete",
    "asphalt",
    "grass",
    "mud",
    "ice",
    "bark",
    "foliage",
)
"""Names of the textures that a world may use; its `texture` arrays hold indices into this."""


@dataclass(frozen=True, slots=True)
class Material:
    """One kind of ground under a track."""

    name: str
    friction: float
    """mu: the largest shear stress as a share of the normal pressure."""
    shear_modulus: float
    """K, the shear from rest after which 63 % of the friction acts, m."""
    resistance: float
    """Motion resistance as a share of the normal force: what it takes to press the rut."""
    texture: str


MATERIALS = (
    Material("gravel", friction=0.80, shear_modulus=0.003, resistance=0.03, texture="gravel"),
    Material("asphalt", friction=0.85, shear_modulus=0.0015, resistance=0.015, texture="asphalt"),
    Material("cement", friction=0.75, shear_modulus=0.002, resistance=0.015, texture="concrete"),
    Material("grass", friction=0.60, shear_modulus=0.010, resistance=0.06, texture="grass"),
    Material("mud", friction=0.35, shear_modulus=0.025, resistance=0.10, texture="mud"),
    Material("ice", friction=0.12, shear_modulus=0.001, resistance=0.01, texture="ice"),
)
"""In the plausible range of Wong, Theory of Ground Vehicles, ch. 2 and table 2.3, scaled to the
short grousers of a robot of 40 kg."""

MATERIAL_NAMES = tuple(material.name for material in MATERIALS)


def material_index(name: str) -> int:
    """Index into MATERIALS.

    Raises:
        ValueError: there is no such material; the message lists those there are.
    """
    if name not in MATERIAL_NAMES:
        hint = did_you_mean(name, MATERIAL_NAMES)
        raise ValueError(f"no terrain is named {name!r}; {hint}known: {', '.join(MATERIAL_NAMES)}")
    return MATERIAL_NAMES.index(name)


def material_table() -> Array:
    """(material, 3): friction, shear modulus [m], resistance, for kernels."""
    return np.array([[m.friction, m.shear_modulus, m.resistance] for m in MATERIALS])
