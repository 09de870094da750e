"""The parking lot: open asphalt, far from anything that a camera could take its bearings from."""

import numpy as np

from grouser.envs.simulation.ground import Ground
from grouser.envs.simulation.world import Boxes, Cylinders, World, join
from grouser.envs.simulation.worlds.light import sunlight
from grouser.envs.simulation.worlds.noise import patches
from grouser.envs.simulation.worlds.placement import (
    Circles,
    draw_textures,
    enclosure,
    scatter,
    standing_boxes,
    standing_cylinders,
    texture_index,
)
from grouser.envs.simulation.worlds.reachability import ROBOT_RADIUS
from grouser.envs.simulation.worlds.relief import level_ground, with_material
from grouser.envs.simulation.worlds.slabs import laid_slabs
from grouser.geometry import Array

_REACH = (24.0, 20.0)  # m
_BAY = (2.5, 5.0)  # width and length, m
_BAYS = 16  # in each of the two rows
_PAINT = 0.003  # thickness of the lines between bays, m
_KERB = 0.15  # width, m


def parking_lot(rng: np.random.Generator, difficulty: float, clutter: float) -> World:
    """An open lot, 48 x 40 m, with a row of bays along either long side.

    Difficulty: a clear place of 9 down to 5 m around the start, 6 to 16 cars, 4 to 14 lamp posts
    and bollards, kerbs from 4 to 9 cm, ice on up to a tenth of the ground, and a sun from 55
    degrees down to 15.
    """
    start = np.append(rng.uniform(-4, 4, 2), rng.uniform(-np.pi, np.pi))
    clear_radius = 9.0 - 4.0 * difficulty
    ground = _ground(rng, difficulty)
    light = sunlight(rng.uniform(-np.pi, np.pi), np.radians(55 - 40 * difficulty))
    rise = 0.04 + 0.05 * difficulty
    barrier = enclosure(ground, _REACH, height=0.9, segment=8.0, texture="concrete")
    cars = _cars(rng, round(clutter * (6 + 10 * difficulty)), ground)
    taken = Circles(start[:2], clear_radius + ROBOT_RADIUS).plus(cars.centre[:, :2], 2.5)
    posts = _posts(rng, round(clutter * (4 + 10 * difficulty)), ground, taken)
    return World(
        name="parking-lot",
        solids=join(cars, barrier),
        n_walls=len(barrier),
        ground=ground,
        start=start,
        clear_radius=clear_radius,
        cylinders=posts,
        slabs=join(_lines(ground), _kerbs(ground, rise)),
        light=light,
    )


def _ground(rng: np.random.Generator, difficulty: float) -> Ground:
    ground = level_ground(_REACH, "asphalt")
    ice = patches(rng, ground.material.shape, ground.cell, share=0.1 * difficulty, size=2.0)
    return with_material(ground, ice, "ice")


def _bay_x() -> Array:
    """(bays + 1,) x of the lines between the bays, m."""
    return np.linspace(-0.5, 0.5, _BAYS + 1) * _BAYS * _BAY[0]


def _bay_y() -> float:
    """y of the middle of the upper row of bays, m: a car's length from the barrier."""
    return _REACH[1] - 1.5 - _BAY[1] / 2


def _lines(ground: Ground) -> Boxes:
    """What is painted between the bays: thick enough to see, far too thin to feel."""
    x = _bay_x()
    xy = np.column_stack([np.tile(x, 2), np.repeat([_bay_y(), -_bay_y()], len(x))])
    return laid_slabs(ground, xy, (0.12, _BAY[1], _PAINT), 0.0, texture_index("plaster"))


def _kerbs(ground: Ground, rise: float) -> Boxes:
    """A kerb behind either row of bays."""
    y = _bay_y() + (_BAY[1] + _KERB) / 2
    size = (_BAYS * _BAY[0], _KERB, rise)
    return laid_slabs(ground, [[0, y], [0, -y]], size, 0.0, texture_index("concrete"))


def _cars(rng: np.random.Generator, n: int, ground: Ground) -> Boxes:
    """Parked cars: a body, and a cabin on it."""
    x, y = _bay_x()[:-1] + _BAY[0] / 2, _bay_y()
    bays = np.column_stack([np.tile(x, 2), np.repeat([y, -y], len(x))])
    xy = rng.permutation(bays)[:n]
    k = len(xy)
    xy = xy + rng.uniform((-0.15, -0.2), (0.15, 0.2), (k, 2))
    yaw = rng.choice([-1, 1], k) * np.pi / 2 + rng.uniform(-0.05, 0.05, k)
    body = rng.uniform((3.9, 1.65, 0.75), (4.5, 1.8, 0.9), (k, 3))
    cabin = body * rng.uniform((0.45, 0.86, 1.6), (0.6, 0.9, 1.8), (k, 3))
    backwards = -0.06 * body[:, :1] * np.column_stack([np.cos(yaw), np.sin(yaw)])
    paint = draw_textures(rng, k, "plaster", "ice", "asphalt", "brick")
    return join(
        standing_boxes(ground, xy, body, yaw, paint),
        standing_boxes(ground, xy + backwards, cabin, yaw, texture_index("ice")),
    )


def _posts(rng: np.random.Generator, n: int, ground: Ground, taken: Circles) -> Cylinders:
    """Lamp posts, and bollards between them."""
    tall = np.arange(n) % 2 == 0
    radius = np.where(tall, rng.uniform(0.08, 0.12, n), rng.uniform(0.10, 0.16, n))
    height = np.where(tall, rng.uniform(4.0, 6.0, n), rng.uniform(0.7, 1.0, n))
    places, which = scatter(rng, radius, _REACH, taken, gap=1.0)
    concrete = texture_index("concrete")
    return standing_cylinders(ground, places, radius[which], height[which], concrete)
