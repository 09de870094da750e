"""How far lines are known to reach, and what lies beside that."""

import numpy as np
import pytest
from numpy.typing import NDArray

from grouser.estimators.line_slam.end_points import EndPoints
from grouser.estimators.line_slam.lines import normals, places_along, points_on, tangents
from grouser.geometry import rotate

LINE = np.array([3.0, 0.4])
CLOSED, OPEN = np.zeros(2, dtype=np.bool_), np.ones(2, dtype=np.bool_)


def known(
    low: float = 0.0, high: float = 4.0, *, open_ends: NDArray[np.bool_] = CLOSED
) -> EndPoints:
    ends = EndPoints()
    ends.add(LINE, points_on(LINE, np.array([low, high])), np.zeros(2), open_ends)
    return ends


def see_again(
    ends: EndPoints, low: float, high: float, sigma: float, open_ends: NDArray[np.bool_]
) -> None:
    seen = points_on(LINE, np.array([low, high]))[None]
    ends.extend(np.array([0]), LINE[None], seen, np.full((1, 2), sigma), open_ends[None])


def test_what_is_seen_beyond_an_end_moves_it_less_a_sigma() -> None:
    ends = known()
    see_again(ends, 1.0, 6.0, 0.1, OPEN)
    assert ends.extents[0] == pytest.approx([0.0, 5.9])
    assert ends.open_ends[0].tolist() == [False, True]


def test_an_end_that_is_seen_where_it_is_known_is_closed_if_it_was_open() -> None:
    ends = known(open_ends=OPEN)
    see_again(ends, 0.2, 2.0, 0.1, CLOSED)
    assert ends.extents[0] == pytest.approx([0.0, 4.0])
    assert ends.open_ends[0].tolist() == [False, True]


def test_a_line_may_be_seen_from_its_other_end() -> None:
    ends = known()
    seen = points_on(LINE, np.array([6.0, 1.0]))[None]
    sigmas, open_ends = np.array([[0.5, 0.1]]), np.array([[True, False]])
    ends.extend(np.array([0]), LINE[None], seen, sigmas, open_ends)
    assert ends.extents[0] == pytest.approx([0.0, 5.5])
    assert ends.open_ends[0].tolist() == [False, True]


def test_beside_is_what_overlaps_by_its_slack_and_by_what_is_not_known() -> None:
    """Against the definition, for many lines seen from an uncertain pose."""
    rng = np.random.default_rng(0)
    lines = np.column_stack([rng.uniform(-5, 5, 40), rng.uniform(-np.pi, np.pi, 40)])
    ends = EndPoints()
    for line in lines:
        low, open_ends = rng.uniform(-6, 6), rng.random(2) < 0.5
        ends.add(line, points_on(line, np.array([low, low + 2])), np.zeros(2), open_ends)
    pose, seen = np.array([1.0, -2.0, 0.7]), rng.uniform(-6, 6, (30, 2, 2))
    A = rng.normal(size=(3, 3))
    C = A @ A.T * 0.05

    there = pose[:2] + rotate(pose[2], seen)
    places = np.sort(places_along(lines[None], there[:, :, None]), axis=1)
    u, n = tangents(lines[:, 1]), normals(lines[:, 1])
    middles = there.mean(axis=1) - pose[:2]
    variance = np.einsum("ni,ij,nj->n", u, C[:2, :2], u) + C[2, 2] * (middles @ n.T) ** 2
    stretch = np.where(ends.open_ends, 1.5, 0.5)
    low = ends.extents[:, 0] - stretch[:, 0] - 2 * np.sqrt(variance)
    high = ends.extents[:, 1] + stretch[:, 1] + 2 * np.sqrt(variance)
    expected = (places[:, 0] <= high) & (places[:, 1] >= low)

    beside = ends.beside(lines, pose, C, seen, slack=0.5, open_slack=1.5, sigmas=2.0)
    assert (beside == expected).all() and 0.1 < expected.mean() < 0.9
