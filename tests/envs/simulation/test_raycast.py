"""Exact rays against Bullet's, and against plain geometry."""

from dataclasses import fields, replace
from typing import Any

import numpy as np
import pybullet
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from grouser.envs.simulation.bullet_dynamics import BulletWorld
from grouser.envs.simulation.ground import Ground
from grouser.envs.simulation.raycast import RayCaster
from grouser.envs.simulation.robot import RobotModel
from grouser.envs.simulation.world import Boxes, Cylinders, World
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


def with_posts(world: World, centre: Array, radius: Array, half_height: Array) -> World:
    texture = np.zeros(len(radius), dtype=np.int64)
    return replace(world, cylinders=Cylinders(centre, radius, half_height, texture))


def on_hills(world: World, rng: np.random.Generator) -> World:
    """Rough ground around the origin."""
    cells, cell = 12, 0.5
    heights = rng.uniform(-0.4, 0.4, (cells + 1, cells + 1))
    ground = Ground(
        heights, np.zeros((cells, cells), dtype=np.int64), cell, np.full(2, -cells * cell / 2)
    )
    return replace(world, ground=ground)


NOTHING = Boxes.none()


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


@given(
    aside=st.floats(-1.5, 1.5), distance=st.floats(1.5, 6.0), radius=st.floats(0.05, 0.8),
    thousandths=st.integers(-600, 600), yaw=st.floats(-np.pi, np.pi),
)  # fmt: skip
@settings(deadline=None)
def test_a_cylinder_is_met_where_its_quadratic_says(
    aside: float, distance: float, radius: float, thousandths: int, yaw: float
) -> None:
    """Solved by numpy's roots, in axes along the ray; over and under its caps too."""
    rise = thousandths / 1000
    assume(np.hypot(aside, distance) > radius + 0.1 and abs(abs(aside) - radius) > 1e-6)
    turn = np.array([[np.cos(yaw), -np.sin(yaw)], [np.sin(yaw), np.cos(yaw)]])
    centre = np.array([[*(turn @ [distance, aside]), 2.0]])
    world = with_posts(world_of(NOTHING), centre, np.array([radius]), np.array([0.5]))
    ray = np.array([*(turn @ [1.0, 0.0]), rise])
    ray /= np.linalg.norm(ray)
    hit = RayCaster(world).cast(np.array([0.0, 0.0, 2.0]), ray[None], 50.0)[0]
    level, expected = float(np.hypot(*ray[:2])), 50.0 if rise >= 0 else 2.0 / -ray[2]
    if abs(aside) < radius:
        enter, leave = sorted(np.roots([1, -2 * distance, distance**2 + aside**2 - radius**2]))
        at_cap = 0.5 / abs(rise) if rise else np.inf  # level way to where the ray leaves its height
        assume(abs(enter.real - at_cap) > 1e-6)  # it grazes the rim
        if enter.real <= at_cap:
            expected = min(expected, enter.real / level)
        assert leave.real > 0
    assert hit == pytest.approx(min(expected, 50.0), rel=1e-9)


def test_a_ray_from_above_meets_the_cap() -> None:
    world = with_posts(
        world_of(NOTHING), np.array([[1.0, 0.0, 0.5]]), np.array([0.3]), np.array([0.5])
    )
    caster = RayCaster(world)
    assert caster.cast(np.array([1.1, 0.0, 4.0]), np.array([[0.0, 0, -1]]), 9.0)[0] == 3.0
    slanted = np.array([[1.0, 0.0, -1.0]]) / np.sqrt(2)
    assert caster.cast(np.array([0.1, 0.0, 2.0]), slanted, 9.0)[0] == pytest.approx(np.sqrt(2))


def test_what_encloses_the_origin_is_not_met() -> None:
    around = with_posts(
        world_of(one_box()), np.array([[2.0, 0.0, 0.5]]), np.array([0.3]), np.array([0.5])
    )
    hit = RayCaster(around).cast(np.array([2.0, 0.0, 0.5]), directions(0.0, 2.0), 9.0)
    np.testing.assert_array_equal(hit, 9.0)


@given(seed=st.integers(0, 10_000))
@settings(deadline=None)  # kernels load
def test_the_ground_is_met_where_dense_sampling_finds_it(seed: int) -> None:
    """Rays from inside and outside of the grid, up, down, level and along its lines."""
    rng = np.random.default_rng(seed)
    world = on_hills(world_of(NOTHING), rng)
    origin = np.array([*rng.uniform(-5, 5, 2), rng.uniform(-0.2, 1.0)])
    rays = rng.normal(size=(24, 3)) * [1, 1, 0.2]
    rays[:4] = np.array(
        [[1, 0, 0], [0, -1, -0.1], [1, 1, -0.05], [0, 0, -1]]
    )  # a grid's favourites
    rays /= np.linalg.norm(rays, axis=1, keepdims=True)
    hits = RayCaster(world).cast(origin, rays, 8.0)
    t = np.linspace(0.0, 8.0, 4001)
    for ray, hit in zip(rays, hits, strict=True):
        points = origin + t[:, None] * ray
        above = points[:, 2] - world.ground.height(points[:, :2])
        down = np.flatnonzero((above[:-1] > 0) & (above[1:] <= 0))
        if hit < 8.0:
            at = origin + hit * ray
            assert at[2] == pytest.approx(float(world.ground.height(at[:2])), abs=1e-9)
        if len(down):  # (a dip that lies between two samples may be met before)
            assert hit <= t[down[0] + 1] + 1e-9
        before = above[t < hit - 2e-3]
        assert np.all(before > 0) or above[0] <= 0


def test_flat_ground_at_its_highest_is_met_all_the_same() -> None:
    """A terrace: rounding must not let a ray slip through it."""
    heights = np.zeros((9, 9))
    heights[:, 4:] = 0.3
    ground = Ground(heights, np.zeros((8, 8), dtype=np.int64), 1.0, np.array([-4.0, -4.0]))
    caster = RayCaster(replace(world_of(NOTHING), ground=ground))
    rng = np.random.default_rng(0)
    target = np.column_stack(
        [rng.uniform(0.1, 3.9, 300), rng.uniform(-4, 4, 300), np.full(300, 0.3)]
    )
    ray = target - [1.0, 0.0, 1.7]
    distance = np.linalg.norm(ray, axis=1)
    hit = caster.cast(np.array([1.0, 0.0, 1.7]), ray / distance[:, None], 20.0)
    np.testing.assert_allclose(hit, distance, rtol=1e-9)


def test_a_slab_is_met_like_any_box() -> None:
    world = replace(world_of(NOTHING), slabs=one_box())
    hit = RayCaster(world).cast(np.array([0.0, 0.0, 0.4]), directions(0.0), 9.0)
    assert hit[0] == 1.5


def test_rays_may_each_have_an_origin_of_their_own() -> None:
    rng = np.random.default_rng(1)
    world = on_hills(make_world("yard", rng), rng)
    posts = np.column_stack([rng.uniform(-5, 5, (20, 2)), np.zeros(20)])
    world = with_posts(world, posts, np.full(20, 0.2), np.full(20, 1.0))
    caster = RayCaster(world)
    origins = world.start[0] + rng.uniform(-1, 1, (60, 3)) * [1, 1, 0.1] + [0, 0, 0.8]
    rays = directions(*rng.uniform(-np.pi, np.pi, 60))
    alone = [caster.cast(o, ray[None], 12.0)[0] for o, ray in zip(origins, rays, strict=True)]
    assert np.array_equal(caster.cast(origins, rays, 12.0), alone)


def test_many_things_are_no_nearer_than_each_alone() -> None:
    """The order in which they are looked at leaves none out."""
    rng = np.random.default_rng(2)
    world = make_world("yard", rng)
    posts = np.column_stack([rng.uniform(-8, 8, (40, 2)), np.zeros(40)])
    world = with_posts(world, posts, rng.uniform(0.05, 0.4, 40), np.full(40, 2.0))
    rays, origin = directions(*np.linspace(-3, 3, 200)), np.array([*world.start[:2], 0.3])
    nearest = np.full(200, 12.0)
    bare = replace(world, solids=NOTHING, cylinders=Cylinders.none())
    solids, cylinders = world.solids, world.cylinders
    for k in range(len(solids)):
        one = Boxes(*(a[k : k + 1] for a in fields_of(solids)))
        nearest = np.minimum(nearest, RayCaster(replace(bare, solids=one)).cast(origin, rays, 12.0))
    for k in range(len(cylinders)):
        post = Cylinders(*(a[k : k + 1] for a in fields_of(cylinders)))
        hit = RayCaster(replace(bare, cylinders=post)).cast(origin, rays, 12.0)
        nearest = np.minimum(nearest, hit)
    assert np.array_equal(RayCaster(world).cast(origin, rays, 12.0), nearest)


def fields_of(things: Boxes | Cylinders) -> list[Any]:
    return [getattr(things, f.name) for f in fields(things)]
