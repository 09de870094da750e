"""What holds of every world, whatever its seed and difficulty: 200 seeds of each kind."""

import math

import cv2
import numpy as np
import pytest

from grouser.envs.simulation.materials import MATERIALS, TEXTURES
from grouser.envs.simulation.world import World
from grouser.envs.simulation.worlds.reachability import FreeSpace, free_space
from grouser.envs.simulation.worlds.registry import make_world, world_names
from grouser.geometry import Array

SEEDS, PARTS = 200, 2
RADIUS = 0.4


@pytest.mark.parametrize("part", range(PARTS))
@pytest.mark.parametrize("name", world_names())
def test_every_world_is_valid(name: str, part: int) -> None:
    for seed in range(part, SEEDS, PARTS):
        difficulty = (0.0, 0.5, 1.0)[seed % 3]
        try:
            check(make_world(name, np.random.default_rng(seed), difficulty=difficulty))
        except AssertionError as error:
            raise AssertionError(f"{name} {seed=} {difficulty=}: {error}") from error


def check(world: World) -> None:
    space = free_space(world)
    the_start_and_five_goals_are_connected(world, space)
    the_robot_cannot_leave(world, space)
    nothing_stands_in_the_clear_circle(world)
    solids_stand_in_the_ground_or_hang_above_the_hull(world)
    tracks_climb_every_slope(world)
    tracks_climb_every_slab(world)
    the_robot_starts_on_level_ground(world)
    what_is_drawn_is_known(world)


def the_start_and_five_goals_are_connected(world: World, space: FreeSpace) -> None:
    goals, start = world.goals, world.start[:2]
    assert len(goals) >= 5
    places = np.vstack([start, goals])
    apart = np.linalg.norm(places[:, None] - places, axis=-1)[~np.eye(len(places), dtype=bool)]
    assert apart.min() >= 3
    assert gaps(world, places).min() > RADIUS - 0.1 / math.sqrt(2)  # of a cell's half diagonal
    _, labels = cv2.connectedComponents(space.free.astype(np.uint8), connectivity=4)
    components = labels[space.index(places)]
    assert components[0] > 0
    assert np.all(components == components[0])


def the_robot_cannot_leave(world: World, space: FreeSpace) -> None:
    _, labels = cv2.connectedComponents(space.free.astype(np.uint8), connectivity=8)
    inside = labels == labels[space.index(world.start[:2])]
    assert not any(edge.any() for edge in (inside[0], inside[-1], inside[:, 0], inside[:, -1]))
    walls = slice(len(world.solids) - world.n_walls, None)
    assert world.n_walls >= 4
    top = world.solids.centre[walls, 2] + world.solids.half_extents[walls, 2]
    assert np.all(top - world.ground.height(world.solids.centre[walls, :2]) >= 0.8), "low walls"


def nothing_stands_in_the_clear_circle(world: World) -> None:
    assert world.clear_radius > 0.15
    assert gaps(world, world.start[None, :2])[0] > world.clear_radius + RADIUS - 1e-9
    slabs, start = world.slabs, world.start[:2]
    if len(slabs):
        own = in_axes_of(slabs.centre[:, :2], slabs.yaw, start[None])[0]
        outside = np.maximum(np.abs(own) - slabs.half_extents[:, :2], 0)
        assert np.hypot(*outside.T).min() > world.clear_radius + RADIUS - 1e-9


def solids_stand_in_the_ground_or_hang_above_the_hull(world: World) -> None:
    solids = world.solids
    bottom, top = (solids.centre[:, 2] + sign * solids.half_extents[:, 2] for sign in (-1, 1))
    side = np.linspace(-1, 1, 10)
    grid = np.column_stack([np.repeat(side, 10), np.tile(side, 10)])
    own = grid * solids.half_extents[:, None, :2]
    c, s = np.cos(solids.yaw)[:, None], np.sin(solids.yaw)[:, None]
    xy = np.stack([c * own[..., 0] - s * own[..., 1], s * own[..., 0] + c * own[..., 1]], axis=-1)
    ground = world.ground.height(xy + solids.centre[:, None, :2])
    standing = bottom <= ground.min(axis=1) + 1e-9
    hanging = bottom >= ground.max(axis=1) + 0.4  # a seat; crowns and tables hang higher
    assert np.all(standing ^ hanging)
    assert np.all(top[standing] > ground.max(axis=1)[standing] + 0.1)
    trunks = world.cylinders
    level = world.ground.height(trunks.centre[:, :2])
    assert np.all(trunks.centre[:, 2] - trunks.half_height <= level)
    assert np.all(trunks.centre[:, 2] + trunks.half_height > level + 0.3)


def tracks_climb_every_slope(world: World) -> None:
    ground = world.ground
    if ground.is_level:
        return
    row, column = np.nonzero(ground.material >= 0)
    for within in ([0.75, 0.25], [0.25, 0.75]):  # the lower and upper triangle of every cell
        xy = ground.origin + ground.cell * (np.column_stack([column, row]) + within)
        assert ground.normal(xy)[..., 2].min() > math.cos(math.radians(20.1))


def tracks_climb_every_slab(world: World) -> None:
    slabs = world.slabs
    if not len(slabs):
        return
    c, s = np.cos(slabs.yaw), np.sin(slabs.yaw)
    for sign_x, sign_y in ((1, 1), (1, -1), (-1, 1), (-1, -1)):
        x, y = sign_x * slabs.half_extents[:, 0], sign_y * slabs.half_extents[:, 1]
        corner = slabs.centre[:, :2] + np.column_stack([c * x - s * y, s * x + c * y])
        rise = slabs.centre[:, 2] + slabs.half_extents[:, 2] - world.ground.height(corner)
        assert rise.max() <= 0.09 + 1e-9


def the_robot_starts_on_level_ground(world: World) -> None:
    around = world.start[:2] + 0.45 * np.array([[1, 1], [1, -1], [-1, 1], [-1, -1], [0, 0]])
    np.testing.assert_allclose(world.ground.height(around), 0, atol=1e-9)


def what_is_drawn_is_known(world: World) -> None:
    for things in (world.solids, world.cylinders, world.slabs):
        assert np.all((things.texture >= 0) & (things.texture < len(TEXTURES)))
        assert np.all(np.isfinite(things.centre))
    assert np.all((world.ground.material >= 0) & (world.ground.material < len(MATERIALS)))
    light = world.light
    assert np.linalg.norm(light.direction) == pytest.approx(1)
    assert 0.1 < light.ambient <= 1 - light.direct < 1
    assert light.half_life > 30
    assert 0 <= min(light.horizon.min(), light.zenith.min())
    assert max(light.horizon.max(), light.zenith.max()) <= 255


def gaps(world: World, places: Array) -> Array:
    """(n,) distance from places (n, 2) to the nearest thing that the robot would touch, m."""
    solids, trunks = world.solids, world.cylinders
    bottom = solids.centre[:, 2] - solids.half_extents[:, 2]
    touched = bottom < world.ground.height(solids.centre[:, :2]) + 0.6
    own = in_axes_of(solids.centre[touched, :2], solids.yaw[touched], places)
    to_box = np.linalg.norm(
        np.maximum(np.abs(own) - solids.half_extents[touched, :2], 0), axis=-1
    ).min(axis=1)
    if not len(trunks):
        return np.asarray(to_box)
    away = np.linalg.norm(places[:, None] - trunks.centre[:, :2], axis=-1) - trunks.radius
    return np.asarray(np.minimum(to_box, away.min(axis=1)))


def in_axes_of(centre: Array, yaw: Array, places: Array) -> Array:
    """(n, k, 2) places (n, 2) in the axes of k boxes."""
    dx, dy = np.moveaxis(places[:, None] - centre, -1, 0)
    c, s = np.cos(yaw), np.sin(yaw)
    return np.stack([c * dx + s * dy, c * dy - s * dx], axis=-1)
