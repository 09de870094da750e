"""Domain randomisation: the same world in another dress, light, grip or clutter.

Every kind draws from a generator of its own, so that one more or less changes no other.
"""

import math
from collections.abc import Iterable, Mapping
from dataclasses import replace
from numbers import Real

import numpy as np
from numpy.typing import NDArray

from grouser.checks import did_you_mean
from grouser.envs.simulation.materials import TEXTURES
from grouser.envs.simulation.world import Boxes, Cylinders, Light, World

RANDOMIZABLE = ("texture", "light", "clutter", "friction", "sensor_noise")
"""texture: which texture is where. light: direction, strength and sky. clutter: the number of
obstacles. friction: of every ground. sensor_noise: left to the environment and its sensors."""

Strengths = dict[str, float]
"""How much of each of RANDOMIZABLE, from 0 (as generated) to 1."""

_SIGMA_FRICTION = 0.25
_TURN, _LIFT, _TINT = math.pi, math.radians(30), 30.0  # rad, rad, grey levels
_LOWEST_SUN = math.radians(8)


def randomization_strengths(randomize: str | Iterable[str] | Mapping[str, float]) -> Strengths:
    """The strength of each kind: 1 for those that are only named, 0 for those that are not.

    Raises:
        ValueError: a kind that does not exist, or a strength outside [0, 1].
    """
    if isinstance(randomize, str):
        randomize = (randomize,)
    given = dict(randomize) if isinstance(randomize, Mapping) else dict.fromkeys(randomize, 1.0)
    for name, strength in given.items():
        if name not in RANDOMIZABLE:
            hint = did_you_mean(name, RANDOMIZABLE)
            raise ValueError(
                f"nothing named {name!r} can be randomised; {hint}known: {', '.join(RANDOMIZABLE)}"
            )
        if not (isinstance(strength, Real) and 0 <= float(strength) <= 1):
            raise ValueError(f"randomize[{name!r}] must be in [0, 1], got {strength!r}")
    return {name: float(given.get(name, 0.0)) for name in RANDOMIZABLE}


def clutter_factor(rng: np.random.Generator, strength: float) -> float:
    """What the number of obstacles is multiplied by: 0.5 to 1.5 at strength 1."""
    return float(1 + strength * rng.uniform(-0.5, 0.5))


def randomized(
    world: World, strengths: Strengths, rngs: Mapping[str, np.random.Generator]
) -> World:
    """The world in another dress and light and with another friction."""
    if strengths["texture"] > 0:
        world = _dressed(world, rngs["texture"], strengths["texture"])
    if strengths["light"] > 0:
        world = replace(world, light=_lit(world.light, rngs["light"], strengths["light"]))
    if strengths["friction"] > 0:
        factor = math.exp(_SIGMA_FRICTION * strengths["friction"] * rngs["friction"].normal())
        scale = factor * world.ground.friction_scale
        world = replace(world, ground=replace(world.ground, friction_scale=scale))
    return world


def _dressed(world: World, rng: np.random.Generator, strength: float) -> World:
    """Each thing, and each material of the ground, gets another texture with this probability."""

    def other(texture: NDArray[np.int64]) -> NDArray[np.int64]:
        drawn = rng.integers(0, len(TEXTURES), texture.shape)
        return np.where(rng.random(texture.shape) < strength, drawn, texture)

    def dressed(boxes: Boxes) -> Boxes:
        return replace(boxes, texture=other(boxes.texture))

    cylinders: Cylinders = replace(world.cylinders, texture=other(world.cylinders.texture))
    return replace(
        world,
        ground=replace(world.ground, textures=other(world.ground.textures)),
        solids=dressed(world.solids),
        cylinders=cylinders,
        slabs=dressed(world.slabs),
    )


def _lit(light: Light, rng: np.random.Generator, strength: float) -> Light:
    """Another place of the sun, other shares of sun and shade, another sky."""
    x, y, z = light.direction
    azimuth = math.atan2(y, x) + strength * rng.uniform(-_TURN, _TURN)
    elevation = math.asin(z) + strength * rng.uniform(-_LIFT, _LIFT)
    elevation = min(max(elevation, _LOWEST_SUN), math.pi / 2)
    ambient = light.ambient * (1 - 0.4 * strength * rng.random())
    direct = light.direct * (1 - 0.6 * strength * rng.random())
    tint = strength * rng.uniform(-_TINT, _TINT, (2, 3))
    level = math.cos(elevation)
    direction = [level * math.cos(azimuth), level * math.sin(azimuth), math.sin(elevation)]
    return replace(
        light,
        direction=np.array(direction),
        ambient=ambient,
        direct=direct,
        horizon=np.clip(light.horizon + tint[0], 0, 255),
        zenith=np.clip(light.zenith + tint[1], 0, 255),
    )
