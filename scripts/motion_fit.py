"""The light model's ground, fitted to how Bullet's robot moves: it should come out as it is."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from scipy.optimize import least_squares

from grouser.envs.simulation.materials import MATERIALS, Material
from grouser.geometry import Array
from grouser.scripts.motion_drives import Setting, drive, twists

PARAMETERS: Final = ("friction", "shear_modulus", "resistance")
"""Of a material: all that the law of the tracks knows of it."""

_START: Final = (0.85, 1.3, 1.2)
"""Factors that a fit begins with: it has to find the right ones by itself."""
_SCALE: Final = (0.01, 0.01, 0.02)
"""m/s, m/s, rad/s that differences of a twist are measured in."""
_STEP: Final = 1e-3
"""Relative, of the finite differences: below it rounding shows, for contacts come and go."""


@dataclass(frozen=True, slots=True, eq=False)
class Fit:
    """A ground as the light model would have it."""

    terrain: str
    factors: Array
    """(3,) of PARAMETERS: fitted ones over those of the material that both share."""
    sigmas: Array
    """(3,) of the factors, by how well the drive tells them."""
    rms: Array
    """(3,) m/s, m/s, rad/s: what differs between the twists in the end."""


def fit(setting: Setting, speeds: Array, reference: Array) -> Fit:
    """Least squares over the factors of the setting's material.

    Args:
        speeds: (n, 2) of the tracks, m/s.
        reference: (n, 3) twists that the other dynamics made of them.
    """

    def differences(factors: Array) -> Array:
        made = twists(drive(setting, speeds, dynamics="fast", materials=scaled(setting, factors)))
        return np.asarray(((made - reference) / _SCALE).ravel())

    found = least_squares(
        differences, _START, bounds=(0.3, 3.0), diff_step=_STEP, xtol=1e-4, ftol=1e-6
    )
    left = found.fun.reshape(-1, 3)
    variance = np.linalg.pinv(found.jac.T @ found.jac) * found.fun.var()
    return Fit(
        setting.terrain,
        np.asarray(found.x),
        np.sqrt(np.diag(variance)),
        np.sqrt((left**2).mean(axis=0)) * _SCALE,
    )


def scaled(setting: Setting, factors: Array) -> Sequence[Material]:
    """MATERIALS with the setting's one changed by factors of PARAMETERS."""
    return [
        replace(
            material,
            **{
                name: getattr(material, name) * float(factor)
                for name, factor in zip(PARAMETERS, factors, strict=True)
            },
        )
        if material.name == setting.terrain
        else material
        for material in MATERIALS
    ]
