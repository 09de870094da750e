"""The yard: as it was before there were other worlds, easier or harder."""

import hashlib

import numpy as np
import pytest

from grouser.envs.sensors.schedule import Schedule
from grouser.envs.simulation.materials import TEXTURES
from grouser.envs.simulation.robot_model import RobotModel
from grouser.envs.simulation.robot_rig import robot_rig
from grouser.envs.simulation.world import World
from grouser.envs.simulation.worlds.registry import make_world

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


def test_at_the_default_difficulty_a_seed_gives_the_yard_that_it_always_gave() -> None:
    """Results that were made before there were difficulties stay comparable."""
    digest = hashlib.sha256()
    for world in YARDS:
        solids = world.solids
        for part in (solids.centre, solids.half_extents, solids.yaw, solids.texture, world.start):
            digest.update(np.round(part * 1e6).astype(np.int64).tobytes())
    assert digest.hexdigest() == (
        "85226861d14208132a7f93cd636c787e9ece4ed949db0acf305390d0b8a55436"
    )


def test_difficulty_strews_more_boxes_around_a_smaller_place() -> None:
    worlds = [make_world("yard", np.random.default_rng(0), difficulty=d) for d in (0.0, 0.5, 1.0)]
    assert [len(world.solids) - world.n_walls for world in worlds] == [20, 40, 60]
    assert [world.clear_radius for world in worlds] == [5.0, 3.5, 2.0]


@pytest.mark.parametrize("seed", range(5))
def test_a_lidar_sees_everything_in_the_depot(seed: int) -> None:
    rig = robot_rig(RobotModel(), dt=0.1, image_size=(320, 240), amounts=Schedule().steady)
    assert rig.lidar is not None
    depot = make_world("depot", np.random.default_rng(seed))
    lowest = (depot.solids.centre + depot.solids.half_extents)[:, 2].min()
    assert lowest > rig.lidar.T_base_lidar[2, 3] + 0.1
