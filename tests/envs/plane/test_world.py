"""Paper 2's worlds as the specification has them, frames, and words about what is none."""

import pickle

import numpy as np
import pytest

from grouser.envs.plane.world import PLANE_WORLDS, make_plane_world
from grouser.geometry import compose


def test_papers_lines_are_y_is_k_x_plus_c() -> None:
    normal, beyond = PLANE_WORLDS["yan-normal"], PLANE_WORLDS["yan-over-range"]
    for world in (normal, beyond):
        a, b = world.segments[:, :2], world.segments[:, 2:]
        slope = (b[:, 1] - a[:, 1]) / (b[:, 0] - a[:, 0])
        np.testing.assert_allclose(slope, [2 / 3, -1, 7 / 9, -0.7])
        np.testing.assert_allclose(a[:, 1] - slope * a[:, 0], [30, 20, -35, -35])
    np.testing.assert_array_equal(
        normal.segments[:, [0, 2]], [[-30, 0], [0, 20], [0, 45], [-60, 0]]
    )
    assert beyond.segments[2, 2] == 60 and normal.segments[2, 2] == 45
    np.testing.assert_array_equal(
        np.delete(beyond.segments, 2, 0), np.delete(normal.segments, 2, 0)
    )


def test_points_are_told_in_the_frame_of_the_start() -> None:
    world = make_plane_world("yan-normal", start=[3.0, 4.0, 2.0])
    back = compose(world.start, np.column_stack([world.course, np.zeros(5)]))[:, :2]
    np.testing.assert_allclose(back, world.waypoints, atol=1e-12)
    there = world.segments_from_start.reshape(-1, 2)
    np.testing.assert_allclose(there, world.from_start(world.segments.reshape(-1, 2)))


def test_worlds_stay_frozen_when_they_are_pickled() -> None:
    world = pickle.loads(pickle.dumps(make_plane_world([[0, 1, 2, 3]])))
    assert world.segments.tolist() == [[0, 1, 2, 3]] and not world.segments.flags.writeable
    assert len(world.course) == 0


@pytest.mark.parametrize(
    ("world", "start", "words"),
    [
        ("yan-norma", None, "did you mean 'yan-normal'?.*yan-over-range; or give segments"),
        ([[0, 1, 2]], None, r"segments \[\[ax, ay, bx, by\], ...\] in m, finite"),
        ([], None, "at least one"),
        ([[0, 1, 2, np.nan]], None, "finite"),
        ([["a", 1, 2, 3]], None, "world must be one of"),
        ("yan-normal", [1, 2], r"start must be x, y \[m\] and heading"),
    ],
)
def test_what_is_no_world_is_refused(world: object, start: object, words: str) -> None:
    with pytest.raises(ValueError, match=words):
        make_plane_world(world, start=start)  # type: ignore[arg-type]
