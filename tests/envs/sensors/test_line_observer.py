"""Bisection against the closed form in every branch; points between them; what nobody may see."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from grouser.envs.sensors.line_observer import (
    OBSERVERS,
    BisectionObserver,
    ClosedFormObserver,
    PointByPointObserver,
    make_line_observer,
)
from grouser.geometry import Array

metres = st.floats(-60, 60)


def drawn(n: int, seed: int) -> tuple[Array, Array]:
    """Segments (n, 4) around a robot at the origin that sees 30 m far, and their lengths (n,)."""
    rng = np.random.default_rng(seed)
    middle = rng.uniform(-45, 45, (n, 2))
    half = rng.uniform(0, 40, (n, 1)) * rng.normal(size=(n, 2)) / 2
    segments = np.hstack([middle - half, middle + half])
    return segments, np.linalg.norm(2 * half, axis=1)


def branch(segments: Array, reach: float) -> Array:
    """(n,) which of the twelve branches of SPEC 2.3 a segment falls into."""
    a, b = segments[:, :2], segments[:, 2:]
    foot = -(a * (b - a)).sum(axis=1) / ((b - a) ** 2).sum(axis=1)
    near_a, near_b = (np.linalg.norm(end, axis=1) <= reach for end in (a, b))
    near_foot = np.linalg.norm(a + foot[:, None] * (b - a), axis=1) <= reach
    case = np.select([foot <= 0, foot >= 1, foot <= 0.5], [0, 1, 2], 3)
    first = np.where(case == 0, near_a, np.where(case == 1, near_b, near_foot))
    second = np.where((case == 0) | (case == 2), near_b, near_a)
    return np.asarray(3 * case + np.where(~first, 0, np.where(second, 1, 2)))


@pytest.mark.parametrize("tolerance", [1e-1, 1e-3, 1e-6])
def test_bisection_agrees_with_the_closed_form_in_every_branch(tolerance: float) -> None:
    segments, lengths = drawn(100_000, seed=0)
    assert set(branch(segments, 30.0)) == set(range(12))
    exact = ClosedFormObserver().observe(segments, (0, 0), 30.0)
    found = BisectionObserver(tolerance=tolerance).observe(segments, (0, 0), 30.0)
    np.testing.assert_array_equal(np.isnan(found), np.isnan(exact))
    seen = ~np.isnan(exact[:, 0])
    away = np.abs(found - exact)[seen] * lengths[seen, None]
    assert away.max() <= tolerance * (1 + 1e-6)
    # To the inner side: no end point is told that the robot does not see.
    assert (found[seen, 0] >= exact[seen, 0] - 1e-9).all()
    assert (found[seen, 1] <= exact[seen, 1] + 1e-9).all()


def test_points_are_at_most_a_spacing_short_of_the_closed_form() -> None:
    segments, lengths = drawn(3000, seed=1)
    exact = ClosedFormObserver().observe(segments, (0, 0), 30.0)
    found = PointByPointObserver(spacing=0.1).observe(segments, (0, 0), 30.0)
    seen = ~np.isnan(found[:, 0])
    assert not np.isnan(exact[seen]).any()
    # What it overlooks lies between two of its points.
    overlooked = ~seen & ~np.isnan(exact[:, 0])
    assert (np.diff(exact[overlooked])[:, 0] * lengths[overlooked] < 0.1).all()
    short = (found - exact)[seen] * lengths[seen, None] * [1, -1]
    assert short.min() >= -1e-9 and short.max() < 0.1


@settings(max_examples=200, deadline=None)
@given(st.tuples(metres, metres, metres, metres), st.tuples(metres, metres), st.floats(0.1, 50))
def test_what_the_closed_form_tells_is_seen_and_nothing_beyond(
    segment: tuple[float, ...], position: tuple[float, float], reach: float
) -> None:
    """Against distances of points, one by one."""
    ends = np.array(segment).reshape(2, 2)
    told = ClosedFormObserver().observe([segment], position, reach)[0]
    t = np.linspace(0, 1, 501)
    points = ends[0] + t[:, None] * (ends[1] - ends[0])
    distance = np.linalg.norm(points - position, axis=1)
    inside = (t >= told[0]) & (t <= told[1])  # all False where told is NaN
    assert (distance[inside] <= reach + 1e-6).all()
    assert (distance[~inside] >= reach - 1e-6).all()


@pytest.mark.parametrize("name", sorted(OBSERVERS))
def test_ends_that_are_turned_round_are_told_turned_round(name: str) -> None:
    segments, _ = drawn(500, seed=2)
    observer = make_line_observer(name)
    there = observer.observe(segments, (1.0, -2.0), 25.0)
    back = observer.observe(segments[:, [2, 3, 0, 1]], (1.0, -2.0), 25.0)
    np.testing.assert_allclose(back, 1 - there[:, ::-1], atol=1e-9)


@pytest.mark.parametrize("name", sorted(OBSERVERS))
def test_a_segment_without_length_is_a_point(name: str) -> None:
    segments = np.array([[3.0, 4.0, 3.0, 4.0], [3.0, 4.1, 3.0, 4.1]])
    seen = make_line_observer(name).observe(segments, (0, 0), 5.0)
    assert np.isfinite(seen[0]).all() and np.isnan(seen[1]).all()


def test_a_line_that_is_only_touched_is_seen_in_one_point() -> None:
    segments = np.array([[-10.0, 30.0, 10.0, 30.0]])
    for name in ("bisection", "closed-form"):
        np.testing.assert_array_equal(
            make_line_observer(name).observe(segments, (0, 0), 30.0), [[0.5, 0.5]]
        )


def test_no_segments_are_no_sight() -> None:
    assert ClosedFormObserver().observe(np.empty((0, 4)), (0, 0), 1.0).shape == (0, 2)


def test_refusals() -> None:
    observer = ClosedFormObserver()
    with pytest.raises(ValueError, match=r"segments must be \(n, 4\) finite numbers.*\(2,\)"):
        observer.observe([0.0, 1.0], (0, 0), 1.0)
    with pytest.raises(ValueError, match=r"position must be two finite numbers \[m\]"):
        observer.observe(np.empty((0, 4)), (0, np.nan), 1.0)
    with pytest.raises(ValueError, match="reach must be positive and finite, m, got 0"):
        observer.observe(np.empty((0, 4)), (0, 0), 0)
    with pytest.raises(ValueError, match="tolerance must be positive and finite, m, got -1"):
        make_line_observer("bisection", tolerance=-1)
    with pytest.raises(ValueError, match="did you mean 'bisection'.*known: bisection, closed-form"):
        make_line_observer("bisecton")
