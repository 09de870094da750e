"""The occupancy grid, against distances computed one by one."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from grouser.envs.simulation.world import Boxes, Cylinders, World
from grouser.envs.simulation.worlds.reachability import FreeSpace, free_space, reachable
from grouser.envs.simulation.worlds.relief import level_ground
from grouser.geometry import Array

REACH = 4.0


def empty_world() -> World:
    return World(
        name="test",
        solids=Boxes.none(),
        n_walls=0,
        ground=level_ground((REACH, REACH), "gravel"),
        start=np.zeros(3),
        clear_radius=0.0,
    )


def boxes(centre: Array, half: Array, yaw: Array) -> Boxes:
    return Boxes(centre, half, yaw, np.zeros(len(yaw), dtype=np.int64))


def nearest(world: World, xy: Array) -> float:
    """Distance from a point (2,) to the nearest thing on the ground, m."""
    found = np.inf
    for centre, half, yaw in zip(
        world.solids.centre, world.solids.half_extents, world.solids.yaw, strict=True
    ):
        R = np.array([[np.cos(yaw), np.sin(yaw)], [-np.sin(yaw), np.cos(yaw)]])
        beyond = np.maximum(np.abs(R @ (xy - centre[:2])) - half[:2], 0)
        found = min(found, float(np.hypot(*beyond)))
    for centre, radius in zip(world.cylinders.centre, world.cylinders.radius, strict=True):
        found = min(found, float(np.linalg.norm(xy - centre[:2])) - radius)
    return found


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), radius=st.floats(0.1, 0.8))
def test_a_cell_is_free_where_all_things_are_farther_than_the_radius(
    seed: int, radius: float
) -> None:
    rng = np.random.default_rng(seed)
    half = rng.uniform(0.05, 1.0, (4, 3))
    centre = np.column_stack([rng.uniform(-REACH, REACH, (4, 2)), half[:, 2]])
    posts = Cylinders(
        np.column_stack([rng.uniform(-REACH, REACH, (3, 2)), np.ones(3)]),
        rng.uniform(0.05, 0.4, 3),
        np.ones(3),
        np.zeros(3, dtype=np.int64),
    )
    solids = boxes(centre, half, rng.uniform(-4, 4, 4))
    world = replace(empty_world(), solids=solids, cylinders=posts)
    space = free_space(world, radius=radius)
    for row, column in rng.integers(0, space.free.shape, (60, 2)):
        xy = space.origin + space.cell * np.array([column, row])
        assert space.free[row, column] == (nearest(world, xy) >= radius)
        assert space.at(xy) == space.free[row, column]


def test_a_wider_robot_has_less_room() -> None:
    solids = boxes(np.array([[1.0, 0.5, 0.5]]), np.array([[0.3, 0.6, 0.5]]), np.array([0.3]))
    world = replace(empty_world(), solids=solids)
    narrow, wide = (free_space(world, radius=radius).free for radius in (0.2, 0.6))
    assert np.all(narrow[wide]) and wide.sum() < narrow.sum()


@pytest.mark.parametrize(("bottom", "blocks"), [(0.0, True), (0.55, True), (0.65, False)])
def test_what_hangs_above_the_robot_blocks_nothing(bottom: float, blocks: bool) -> None:
    crown = boxes(np.array([[0, 0, bottom + 0.5]]), np.array([[1.0, 1.0, 0.5]]), np.zeros(1))
    assert free_space(replace(empty_world(), solids=crown)).at([0.0, 0.0]) == (not blocks)


@pytest.mark.parametrize(("rise", "blocks"), [(0.05, False), (0.09, False), (0.10, True)])
def test_slabs_block_from_the_height_that_tracks_do_not_climb(rise: float, blocks: bool) -> None:
    slab = boxes(np.array([[0, 0, rise / 2]]), np.array([[0.5, 0.5, rise / 2]]), np.zeros(1))
    space = free_space(replace(empty_world(), slabs=slab))
    assert space.at([0.0, 0.0]) == space.at([0.85, 0.0]) == (not blocks)
    assert space.at([1.0, 0.0])


@pytest.mark.parametrize(("slope", "blocks"), [(0.35, False), (0.45, True)])
def test_steep_ground_blocks(slope: float, blocks: bool) -> None:
    """22 degrees are a slope of 0.404."""
    ground = level_ground((REACH, REACH), "gravel")
    x = ground.origin[0] + ground.cell * np.arange(ground.heights.shape[1])
    ramp = slope * np.clip(x, 0, 1)
    hill = replace(ground, heights=np.broadcast_to(ramp, ground.heights.shape).copy())
    space = free_space(replace(empty_world(), ground=hill))
    assert space.at([0.5, 0.0]) == (not blocks)
    assert space.at([-0.5, 0.0]) and space.at([1.5, 0.0])


def test_reachable_is_what_is_on_this_side_of_a_wall() -> None:
    wall = boxes(np.array([[0, 0, 0.5]]), np.array([[0.1, 6.0, 0.5]]), np.zeros(1))
    space = free_space(replace(empty_world(), solids=wall))
    near = reachable(space, [-2.0, 0.0])
    assert near.at([-1.0, 3.0]) and not near.at([1.0, 0.0])
    assert not reachable(space, [0.0, 0.0]).free.any(), "from within the wall nowhere"
    assert np.all(near.points()[:, 0] < -0.5)


def test_points_and_index_are_inverse() -> None:
    space = FreeSpace(np.random.default_rng(0).random((7, 11)) < 0.5, 0.1, np.array([-2.0, 3.0]))
    row, column = space.index(space.points())
    assert np.array_equal(np.argwhere(space.free), np.column_stack([row, column]))
