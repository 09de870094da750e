"""Generated worlds keep their promises for every seed."""

import numpy as np
import pytest

from grouser.envs.simulation.materials import TEXTURES
from grouser.envs.simulation.world import World
from grouser.envs.simulation.worlds.registry import make_world, world_names

YARDS = [make_world("yard", np.random.default_rng(seed)) for seed in range(20)]


@pytest.mark.parametrize("world", YARDS)
def test_nothing_stands_where_the_robot_may_drive(world: World) -> None:
    solids, robot_radius = world.solids, 0.38
    dx, dy = (world.start[:2] - solids.centre[:, :2]).T
    c, s = np.cos(solids.yaw), np.sin(solids.yaw)
    own = np.stack([c * dx + s * dy, c * dy - s * dx], axis=-1)
    gap = np.linalg.norm(np.maximum(np.abs(own) - solids.half_extents[:, :2], 0), axis=-1)
    assert gap.min() > world.clear_radius + robot_radius


@pytest.mark.parametrize("world", YARDS)
def test_a_yard_is_walled_and_strewn_with_boxes(world: World) -> None:
    n = len(world.solids) - world.n_walls
    assert (world.n_walls, n) == (4, 40)
    obstacles = world.solids.centre[:n]
    reach = np.abs(obstacles[:, :2]).max(axis=1) + world.solids.footprint_radius[:n]
    assert reach.max() <= 9.0
    np.testing.assert_allclose(obstacles[:, 2], world.solids.half_extents[:n, 2])  # on the ground
    assert set(world.solids.texture.tolist()) <= set(range(len(TEXTURES)))
    distance = np.linalg.norm(obstacles[:, None, :2] - obstacles[None, :, :2], axis=-1)
    radius = world.solids.footprint_radius[:n]
    overlap = radius[:, None] + radius - distance
    assert overlap[~np.eye(n, dtype=bool)].max() < 0


def test_a_seed_makes_a_world_and_another_makes_another() -> None:
    same = make_world("yard", np.random.default_rng(3))
    assert np.array_equal(same.solids.centre, YARDS[3].solids.centre)
    assert not np.array_equal(same.solids.centre, YARDS[4].solids.centre)
    assert not np.array_equal(same.start, YARDS[4].start)


def test_worlds_are_frozen() -> None:
    with pytest.raises(ValueError, match="read-only"):
        YARDS[0].solids.centre[0] = 0


def test_an_unknown_world_is_refused_with_those_there_are() -> None:
    with pytest.raises(ValueError, match=r"no world is named 'yrad'; did you mean 'yard'\? known:"):
        make_world("yrad", np.random.default_rng(0))
    assert "yard" in world_names()
