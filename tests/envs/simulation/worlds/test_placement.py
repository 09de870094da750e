"""Things are put where they fit, stand in the ground, and leave no gap in a wall."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from grouser.envs.simulation.ground import Ground
from grouser.envs.simulation.world import Boxes
from grouser.envs.simulation.worlds.footprint import heights_under, lowest_under
from grouser.envs.simulation.worlds.placement import (
    Circles,
    enclosure,
    scatter,
    standing_boxes,
    standing_cylinders,
)
from grouser.envs.simulation.worlds.relief import Waves, cell_slopes, level_ground, with_hills
from grouser.envs.simulation.worlds.slabs import along_contours, apart_from, laid_slabs

REACH = (6.0, 4.0)


def hilly(seed: int) -> Ground:
    return with_hills(
        np.random.default_rng(seed),
        level_ground(REACH, "grass"),
        steepest=0.34,
        waves=[Waves(1.5, 6.0)],
        level_at=(0, 0),
        level_radius=0.5,
    )


@settings(max_examples=30, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), n=st.integers(0, 60), gap=st.floats(0, 1))
def test_scattered_circles_keep_their_distance(seed: int, n: int, gap: float) -> None:
    rng = np.random.default_rng(seed)
    radius, taken = rng.uniform(0.1, 1.0, n), Circles([[1.0, -1.0]], 1.5)
    xy, which = scatter(
        rng, radius, REACH, taken, gap=gap, allowed=lambda places, r: places[:, 0] > r
    )
    assert len(xy) == len(which) and np.all(np.diff(which) > 0)
    assert len(which) > 0 or n == 0 or gap > 0.5 or radius.min() > 0.5
    kept = radius[which]
    assert np.all(np.abs(xy) + kept[:, None] <= REACH)
    assert np.all(xy[:, 0] > kept)
    assert np.all(np.linalg.norm(xy - taken.xy, axis=1) > 1.5 + kept + gap)
    apart = np.linalg.norm(xy[:, None] - xy, axis=-1) - kept - kept[:, None]
    assert np.all(apart[~np.eye(len(kept), dtype=bool)] > gap)


@settings(max_examples=30, deadline=None)
@given(seed=st.integers(0, 2**32 - 1))
def test_no_ground_under_a_box_lies_below_it_wherever_one_looks(seed: int) -> None:
    rng, ground, n = np.random.default_rng(seed), hilly(seed % 5), 12
    xy, yaw = rng.uniform(-3, 3, (n, 2)), rng.uniform(-4, 4, n)
    boxes = standing_boxes(ground, xy, rng.uniform(0.1, 2.0, (n, 3)), yaw, 0)
    own = rng.uniform(-1, 1, (n, 400, 2)) * boxes.half_extents[:, None, :2]
    c, s = np.cos(yaw)[:, None], np.sin(yaw)[:, None]
    inside = np.stack([c * own[..., 0] - s * own[..., 1], s * own[..., 0] + c * own[..., 1]], -1)
    below = ground.height(inside + xy[:, None])
    assert np.all(boxes.centre[:, 2] - boxes.half_extents[:, 2] <= below.min(axis=1))
    assert np.all(boxes.centre[:, 2] + boxes.half_extents[:, 2] > heights_under(boxes, ground).T)


def test_on_level_ground_boxes_stand_on_it_and_not_in_it() -> None:
    ground = level_ground(REACH, "grass")
    box = standing_boxes(ground, [1.0, 2.0], (0.4, 0.6, 0.8), 0.3, 2)
    np.testing.assert_array_equal(box.centre, [[1.0, 2.0, 0.4]])
    np.testing.assert_array_equal(box.half_extents, [[0.2, 0.3, 0.4]])
    post = standing_cylinders(ground, np.array([[1.0, 2.0]]), np.array([0.1]), np.array([1.4]), 1)
    assert (post.centre[0, 2], post.half_height[0]) == (0.7, 0.7)


@pytest.mark.parametrize("segment", [3.0, 30.0])
def test_an_enclosure_has_no_gap_and_lets_the_inside_be(segment: float) -> None:
    ground = hilly(1)
    walls = enclosure(ground, REACH, height=1.0, segment=segment, texture="brick")
    length = np.hypot(*REACH)
    angle = np.linspace(-np.pi, np.pi, 721)
    ray = np.linspace(0, length + 1, 900)[:, None, None]
    points = ray * np.column_stack([np.cos(angle), np.sin(angle)])
    c, s = np.abs(np.cos(walls.yaw)), np.abs(np.sin(walls.yaw))
    half = np.column_stack(
        [c * walls.half_extents[:, 0] + s * walls.half_extents[:, 1],
         s * walls.half_extents[:, 0] + c * walls.half_extents[:, 1]]
    )  # fmt: skip
    within = np.zeros(points.shape[:2], dtype=bool)
    for centre, extent in zip(walls.centre[:, :2], half, strict=True):
        within |= np.all(np.abs(points - centre) <= extent, axis=-1)
    inside = np.all(np.abs(points) < REACH, axis=-1)
    assert not np.any(within & inside)
    assert np.all(within.any(axis=0)), "every way out meets a wall"


def test_slabs_are_as_high_as_asked_above_the_lowest_ground_or_left_out() -> None:
    ground, rng = hilly(2), np.random.default_rng(0)
    xy, size = (
        rng.uniform(-3, 3, (200, 2)),
        rng.uniform((0.1, 0.1, 0.03), (0.8, 0.3, 0.09), (200, 3)),
    )
    laid = laid_slabs(ground, xy, size, rng.uniform(-4, 4, 200), 0)
    assert 50 < len(laid) < 200
    rise = laid.centre[:, 2] + laid.half_extents[:, 2] - heights_under(laid, ground).min(axis=1)
    assert np.all((rise > 0.03 - 1e-9) & (rise < 0.09 + 1e-9))
    on_level = laid_slabs(level_ground(REACH, "mud"), xy, size, 0.0, 0)
    assert len(on_level) == 200
    np.testing.assert_allclose(on_level.centre[:, 2] + on_level.half_extents[:, 2], size[:, 2])


def test_slabs_that_tracks_do_not_climb_are_refused() -> None:
    with pytest.raises(ValueError, match=r"slabs are 0.09 m high at most, got 0.120 m"):
        laid_slabs(level_ground(REACH, "mud"), [0, 0], (1.0, 1.0, 0.12), 0.0, 0)


def test_what_lies_along_contours_is_level() -> None:
    ground, rng = hilly(3), np.random.default_rng(0)
    xy = rng.uniform(-3, 3, (50, 2))
    yaw, step = along_contours(ground, xy, np.zeros(50)), 1e-4
    ahead = xy + step * np.column_stack([np.cos(yaw), np.sin(yaw)])
    np.testing.assert_allclose(ground.height(ahead), ground.height(xy), atol=1e-12)


def test_apart_from_keeps_what_does_not_reach_into_the_circle() -> None:
    half = np.array([[0.3, 0.4, 0.1]] * 2)
    boxes = Boxes(np.array([[1.6, 0, 0], [0, 1.4, 0]]), half, np.zeros(2), np.zeros(2, np.int64))
    assert apart_from(boxes, [0, 0], 1.0).centre[:, 0].tolist() == [1.6]


def test_the_lowest_ground_is_bounded_also_between_the_samples() -> None:
    ground = hilly(4)
    wide = standing_boxes(ground, [0.0, 0.0], (6.0, 4.0, 1.0), 0.2, 0)
    steepest = float(cell_slopes(ground.heights, ground.cell).max())
    assert lowest_under(wide, ground, steepest)[0] <= heights_under(wide, ground).min()
