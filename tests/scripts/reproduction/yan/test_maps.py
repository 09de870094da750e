"""A map's lines against the true ones, whichever way round they are written."""

import numpy as np
import pytest

from grouser.envs.plane.world import make_plane_world
from grouser.estimators.line_slam.lines import line_through, places_along, turned_over
from grouser.estimators.line_slam.map import LineMap
from grouser.geometry import Array
from grouser.scripts.reproduction.yan.maps import ends_in_world, map_errors

WORLD = make_plane_world("yan-over-range")
SEGMENTS = WORLD.segments_from_start
TRUE = line_through(SEGMENTS[:, :2], SEGMENTS[:, 2:])


def map_of(lines: Array) -> LineMap:
    places = places_along(lines[:, None], SEGMENTS.reshape(-1, 2, 2)[: len(lines)])
    n = len(lines)
    return LineMap(
        lines, np.eye(2 * n), np.sort(places), np.zeros((n, 2), bool), np.ones(n, np.int64)
    )


def test_a_true_map_has_no_errors_and_its_third_line_ends_where_it_ends() -> None:
    lines = TRUE.copy()
    lines[1:3] = turned_over(lines[1:3])
    errors = map_errors(map_of(lines), SEGMENTS, WORLD.start)
    assert errors.r < 1e-9 and errors.alpha < 1e-9
    assert errors.third_end == pytest.approx(60)
    ends = ends_in_world(map_of(lines), WORLD.start)
    assert np.abs(np.sort(ends[..., 0]) - np.sort(WORLD.segments[:, 0::2])).max() < 1e-9


def test_errors_are_those_that_were_made() -> None:
    errors = map_errors(map_of(TRUE + [0.2, -0.01]), SEGMENTS, WORLD.start)
    assert errors.r == pytest.approx(0.2) and errors.alpha == pytest.approx(0.01)


def test_a_map_without_the_third_line_has_no_third_end() -> None:
    assert np.isnan(map_errors(map_of(TRUE[:2]), SEGMENTS, WORLD.start).third_end)
