"""Lights of a day: sun from high to low, clouds, lamps."""

import math

import numpy as np

from grouser.envs.simulation.world import Light
from grouser.geometry import Array

_NOON = (np.array([190.0, 212.0, 232.0]), np.array([112.0, 160.0, 222.0]))  # horizon, zenith
_DUSK = (np.array([238.0, 178.0, 120.0]), np.array([84.0, 100.0, 150.0]))
_CLOUDS = (np.array([212.0, 214.0, 216.0]), np.array([186.0, 190.0, 196.0]))
_CEILING = (np.array([206.0, 202.0, 192.0]), np.array([232.0, 229.0, 220.0]))
_HIGH = math.radians(30)  # from here upwards the sky is that of noon


def sunlight(
    azimuth: float, elevation: float, *, strength: float = 1.0, half_life: float = np.inf
) -> Light:
    """A clear sky; the lower the sun [rad], the redder the horizon and the dimmer all.

    Args:
        strength: of light and sky, 1 for a bright day.
        half_life: time in which the light falls to a half, s.
    """
    high = min(1.0, elevation / _HIGH)
    horizon, zenith = (
        high * noon + (1 - high) * dusk for noon, dusk in zip(_NOON, _DUSK, strict=True)
    )
    return Light(
        direction=_direction(azimuth, elevation),
        ambient=strength * (0.40 + 0.15 * high),
        direct=strength * (0.35 + 0.10 * high),
        horizon=strength * horizon,
        zenith=strength * zenith,
        half_life=half_life,
    )


def overcast(*, strength: float = 1.0, half_life: float = np.inf) -> Light:
    """Clouds: nearly the same light from everywhere."""
    return _from_above(_CLOUDS, 0.75, 0.20, strength, half_life)


def lamplight(*, strength: float = 1.0) -> Light:
    """Lamps at a bright ceiling: what is seen above the walls is no sky."""
    return _from_above(_CEILING, 0.65, 0.35, strength, np.inf)


def _from_above(
    sky: tuple[Array, Array], ambient: float, direct: float, strength: float, half_life: float
) -> Light:
    return Light(
        direction=_direction(math.radians(35), math.radians(60)),
        ambient=strength * ambient,
        direct=strength * direct,
        horizon=strength * sky[0],
        zenith=strength * sky[1],
        half_life=half_life,
    )


def _direction(azimuth: float, elevation: float) -> Array:
    level = math.cos(elevation)
    return np.array([level * math.cos(azimuth), level * math.sin(azimuth), math.sin(elevation)])
