"""How a robot is put down on uneven ground."""

import math
from collections.abc import Sequence

import numpy as np

from grouser.envs.simulation.materials import Material
from grouser.envs.simulation.robot_model import RobotModel
from grouser.envs.simulation.surface import Surface, surface_under
from grouser.envs.simulation.track_law import Law, rotation_of
from grouser.envs.simulation.world import World
from grouser.geometry import Array, rotate


def standing_body(
    world: World, model: RobotModel, law: Law, materials: Sequence[Material]
) -> Array:
    """(13,) state, at rest at the start of a world, on the plane that fits the surface under its
    tracks best (least squares), or as much higher as its hull needs to be clear of the ground."""
    x, y, heading = world.start
    surface = Surface.of(world, materials)
    patches = law.points[law.part < 2]
    sole = patches[patches[:, 2] == patches[:, 2].min()]
    points = world.start[:2] + rotate(heading, sole[:, :2])
    centred = points - [x, y]
    (slope_x, slope_y, height), *_ = np.linalg.lstsq(
        np.column_stack([centred, np.ones(len(points))]), _heights(surface, points), rcond=None
    )
    normal = np.array([-slope_x, -slope_y, 1.0]) / math.sqrt(1 + slope_x**2 + slope_y**2)
    body = np.zeros(13)
    body[:3] = [x, y, height] + model.com_height * normal
    body[3:7] = _upright(normal, heading)
    body[2] += _rise(surface, law, body)
    return body


def _rise(surface: Surface, law: Law, body: Array) -> float:
    """How much the deepest point of the hull is below the surface, m."""
    R = np.empty((3, 3))
    rotation_of(body, R)
    hull = body[:3] + law.points[law.part == 2] @ R.T
    return max(0.0, float(np.max(_heights(surface, hull[:, :2]) - hull[:, 2])))


def _upright(normal: Array, heading: float) -> Array:
    """(4,) quaternion x y z w: turned by a heading, then tilted the shortest way to a normal."""
    a, b, d = -normal[1], normal[0], 1 + normal[2]  # the tilt has no part about z
    norm = math.sqrt(a * a + b * b + d * d)
    a, b, d = a / norm, b / norm, d / norm
    s, c = math.sin(heading / 2), math.cos(heading / 2)
    return np.array([a * c + b * s, b * c - a * s, d * s, d * c])


def _heights(surface: Surface, points: Array) -> Array:
    """(n,) of the surface at points (n, 2), found from far below, m."""
    deep = surface.heights.min() - 1.0
    below = np.column_stack([points, np.full(len(points), deep)])
    slabs = np.arange(len(surface.slabs))
    found = np.empty((len(points), 9))
    surface_under(np.zeros(13), np.eye(3), below, surface, slabs, len(slabs), np.inf, found)
    return np.asarray(deep - found[:, 4] / found[:, 7])
