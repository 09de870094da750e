"""Lines in normal form: the same points whichever way they are written and whoever sees them."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from grouser.estimators.line_slam.lines import (
    line_through,
    lines_in_frame,
    lines_to_world,
    normals,
    places_along,
    points_on,
    turned_over,
)
from grouser.estimators.line_slam.measurements import LineMeasurements, no_lines
from grouser.geometry import Array, compose, rotate

coordinate = st.floats(-50, 50)
angle = st.floats(-3.1, 3.1)


def gap(lines: Array, points: Array) -> float:
    """m; how far points are from lines, at most."""
    away = np.sum(normals(lines[..., 1]) * points, axis=-1) - lines[..., 0]
    return float(np.abs(away).max())


@given(st.tuples(coordinate, coordinate), angle, st.floats(0.1, 30))
def test_a_line_goes_through_its_points_with_its_tangent_along_them(
    a: tuple[float, float], direction: float, length: float
) -> None:
    b = np.add(a, length * np.array([np.cos(direction), np.sin(direction)]))
    line = line_through(a, b)
    assert gap(line, np.array([a, b])) < 1e-11
    along = places_along(line, b) - places_along(line, a)
    np.testing.assert_allclose(along, length, atol=1e-11)
    np.testing.assert_allclose(points_on(line, places_along(line, a)), a, atol=1e-11)


@given(st.tuples(coordinate, angle), st.tuples(coordinate, coordinate, angle), coordinate)
def test_a_seen_line_holds_the_same_points(
    line: tuple[float, float], pose: tuple[float, float, float], t: float
) -> None:
    seen = lines_in_frame(line, pose)
    in_robot = points_on(seen, t)
    in_world = np.asarray(pose[:2]) + rotate(pose[2], in_robot)
    assert gap(np.asarray(line), in_world) < 1e-11
    np.testing.assert_allclose(lines_to_world(seen, pose), line, atol=1e-11)


@given(st.tuples(coordinate, angle), coordinate)
def test_a_line_turned_over_is_the_same_line(line: tuple[float, float], t: float) -> None:
    other = turned_over(line)
    assert gap(other, points_on(line, t)) < 1e-11
    np.testing.assert_allclose(turned_over(other), line, atol=1e-12)


def test_frames_chain() -> None:
    line, a, b = np.array([3.0, 0.7]), np.array([1.0, 2.0, 0.5]), np.array([-2.0, 0.3, -1.0])
    np.testing.assert_allclose(
        lines_in_frame(lines_in_frame(line, a), b), lines_in_frame(line, compose(a, b)), atol=1e-12
    )


def test_measurements_are_chosen_together() -> None:
    rng = np.random.default_rng(0)
    seen = LineMeasurements(
        rng.normal(size=(3, 2)),
        rng.normal(size=(3, 2, 2)),
        rng.normal(size=(3, 2, 2)),
        rng.normal(size=(3, 2)),
        np.array([[True, False], [False, True], [True, True]]),
    )
    chosen = seen[np.array([2, 0])]
    assert len(chosen) == 2 and len(no_lines()) == 0
    np.testing.assert_array_equal(chosen.lines, seen.lines[[2, 0]])
    np.testing.assert_array_equal(chosen.ends, seen.ends[[2, 0]])
    np.testing.assert_array_equal(chosen.open_ends, seen.open_ends[[2, 0]])
    assert len(seen[np.zeros(3, dtype=np.bool_)]) == 0
