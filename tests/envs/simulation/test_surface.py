"""The surface as kernels read it is the ground that everybody else sees, and no slab is missed."""

from dataclasses import replace

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from grouser.envs.simulation.ground import Ground
from grouser.envs.simulation.materials import MATERIALS, material_index
from grouser.envs.simulation.surface import Surface, look_around, surface_under
from grouser.envs.simulation.world import Boxes, World
from grouser.geometry import Array
from tests.envs.simulation.grounds import open_world

REACH = 0.6


def uneven(rng: np.random.Generator, n_slabs: int) -> World:
    """Random heights and materials, strewn with random slabs."""
    ground = Ground(
        heights=rng.uniform(-0.1, 0.1, (21, 31)),
        material=rng.integers(0, len(MATERIALS), (20, 30)),
        cell=0.2,
        origin=np.array([-3.0, -2.0]),
    )
    half = rng.uniform([0.05, 0.05, 0.1], [0.5, 0.5, 0.2], (n_slabs, 3))
    centre = np.column_stack(
        [rng.uniform([-2.5, -1.5], [2.5, 1.5], (n_slabs, 2)), np.zeros(n_slabs)]
    )
    slabs = Boxes(centre, half, rng.uniform(-3, 3, n_slabs), np.zeros(n_slabs, dtype=np.int64))
    return replace(open_world(), ground=ground, slabs=slabs)


def rows_under(
    surface: Surface, xy: Array, depth: float, nearby: NDArray[np.int64], n: int
) -> Array:
    """What `surface_under` finds for points at a depth."""
    points = np.column_stack([xy, np.full(len(xy), depth)])
    found = np.empty((len(xy), 9))
    count = surface_under(np.zeros(13), np.eye(3), points, surface, nearby, n, np.inf, found)
    return found[:count]


@settings(max_examples=30, deadline=None)
@given(seed=st.integers(0, 2**32 - 1))
def test_without_slabs_it_is_the_ground(seed: int) -> None:
    rng = np.random.default_rng(seed)
    world = uneven(rng, 0)
    xy = rng.uniform([-2.9, -1.9], [2.9, 1.9], (200, 2))
    none = np.empty(0, dtype=np.int64)
    found = rows_under(Surface.of(world, MATERIALS), xy, -1.0, none, 0)
    assert len(found) == 200
    np.testing.assert_allclose(found[:, 5:8], world.ground.normal(xy), atol=1e-12)
    gap = (-1.0 - world.ground.height(xy)) * world.ground.normal(xy)[:, 2]
    np.testing.assert_allclose(found[:, 4], gap, atol=1e-12)
    assert np.array_equal(found[:, 8], world.ground.material_at(xy))


@settings(max_examples=30, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), depth=st.floats(-0.1, 0.2))
def test_what_is_nearby_is_all_that_can_be_touched(seed: int, depth: float) -> None:
    rng = np.random.default_rng(seed)
    world = uneven(rng, 40)
    surface = Surface.of(world, MATERIALS)
    nearby = np.zeros(40, dtype=np.int64)
    middle = rng.uniform([-2.0, -1.0], [2.0, 1.0])
    n, top = look_around(surface, *middle, REACH, nearby)
    away, direction = rng.uniform(0, REACH, 200), rng.uniform(-np.pi, np.pi, 200)
    xy = middle + away[:, None] * np.column_stack([np.cos(direction), np.sin(direction)])
    seen = rows_under(surface, xy, depth, nearby, n)
    every = rows_under(surface, xy, depth, np.arange(40, dtype=np.int64), 40)
    assert np.array_equal(seen, every)
    heights = depth - seen[:, 4] / seen[:, 7]
    assert len(seen) == 0 or heights.max() <= top + 1e-12


def test_a_slab_is_of_cement_with_its_top_level() -> None:
    world = open_world("mud", slabs=Boxes(
        np.array([[1.0, 0.0, 0.0]]), np.array([[0.5, 0.5, 0.08]]), np.array([0.3]),
        np.zeros(1, dtype=np.int64),
    ))  # fmt: skip
    on, off = rows_under(
        Surface.of(world, MATERIALS),
        np.array([[1.0, 0.1], [2.0, 0.0]]),
        -0.1,
        np.arange(1, dtype=np.int64),
        1,
    )
    assert on[8] == material_index("cement") and off[8] == material_index("mud")
    np.testing.assert_allclose([on[4], off[4]], [-0.18, -0.1])
    np.testing.assert_allclose(on[5:8], [0, 0, 1])
