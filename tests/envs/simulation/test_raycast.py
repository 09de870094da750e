"""Exact rays against Bullet's, and against plain geometry."""

import numpy as np
import pybullet
import pytest

from grouser.envs.simulation.bullet_dynamics import BulletWorld
from grouser.envs.simulation.ground import Ground
from grouser.envs.simulation.raycast import RayCaster
from grouser.envs.simulation.robot import RobotModel
from grouser.envs.simulation.world import Boxes, World
from grouser.envs.simulation.worlds.registry import make_world
from grouser.geometry import Array


def one_box(yaw: float = 0.0) -> Boxes:
    return Boxes(
        np.array([[2.0, 0.0, 0.5]]), np.array([[0.5, 0.25, 0.5]]), np.array([yaw]), np.array([1])
    )


def world_of(boxes: Boxes) -> World:
    """These boxes on a level ground."""
    return World(
        name="test", solids=boxes, n_walls=0, ground=Ground.flat(20.0), start=np.zeros(3),
        clear_radius=1.0,
    )  # fmt: skip


def directions(*angles: float) -> Array:
    return np.array([[np.cos(a), np.sin(a), 0.0] for a in angles])


def test_a_ray_meets_the_near_side() -> None:
    caster = RayCaster(world_of(one_box()))
    hit = caster.cast(np.array([0.0, 0.0, 0.4]), directions(0.0, np.pi, np.arctan2(0.24, 1.5)), 9.0)
    np.testing.assert_allclose(hit, [1.5, 9.0, np.hypot(0.24, 1.5)])


def test_a_turned_box_is_met_where_its_corner_is() -> None:
    caster = RayCaster(world_of(one_box(np.arctan2(0.25, 0.5))))
    hit = caster.cast(np.array([0.0, 0.0, 0.4]), directions(0.0), 9.0)
    assert hit[0] == pytest.approx(2 - 0.25 / np.sin(np.arctan2(0.25, 0.5)), abs=1e-12)


def test_rays_pass_above_a_box_and_end_on_the_ground() -> None:
    caster = RayCaster(world_of(one_box()))
    assert caster.cast(np.array([0.0, 0.0, 1.01]), directions(0.0), 9.0)[0] == 9.0
    down = np.array([[np.cos(0.5), 0.0, -np.sin(0.5)]])
    assert caster.cast(np.array([0.0, 5.0, 1.0]), down, 9.0)[0] == pytest.approx(1 / np.sin(0.5))


def test_rays_agree_with_bullet() -> None:
    rng = np.random.default_rng(5)
    world = make_world("yard", rng)
    bullet = BulletWorld(RobotModel())
    bullet.load(world)
    pybullet.removeBody(bullet.body, physicsClientId=bullet.client)
    caster, reach = RayCaster(world), 15.0
    for _ in range(5):
        origin = np.append(world.start[:2] + rng.uniform(-2, 2, 2), 0.3)
        rays = directions(*rng.uniform(-np.pi, np.pi, 200))
        rays[:, 2] = rng.uniform(0, 0.1, len(rays))
        rays /= np.linalg.norm(rays, axis=1, keepdims=True)
        ours = caster.cast(origin, rays, reach)
        theirs = pybullet.rayTestBatch(
            [origin.tolist()] * len(rays), (origin + reach * rays).tolist(),
            physicsClientId=bullet.client,
        )  # fmt: skip
        # Bullet's rays stop up to some millimetres before a box (its collision margin).
        off = np.abs(ours - reach * np.array([hit[2] for hit in theirs]))
        assert np.mean(off < 0.01) > 0.99  # the rest graze a corner
    bullet.close()
