"""Lines of the map that are one, and those that are not."""

import numpy as np
import pytest

from grouser.estimators.line_slam.end_points import EndPoints
from grouser.estimators.line_slam.lines import points_on, turned_over
from grouser.estimators.line_slam.merging import MergingOptions, Twins, find_twins
from grouser.estimators.line_slam.state import LineState
from grouser.geometry import Array

SIGMA = np.diag([0.02, 0.005]) ** 2
LINE = np.array([3.0, 0.4])


def twins(
    other: Array, places: tuple[float, float] = (0.0, 4.0), *, noise: Array = SIGMA
) -> Twins | None:
    state, ends = LineState(np.zeros(3), np.zeros(0)), EndPoints()
    closed = np.zeros(2, dtype=np.bool_)
    for line, extent in ((other, np.array(places)), (LINE, np.array([0.0, 4.0]))):
        state.add(line, (), np.zeros((2, 0)), noise)
        ends.add(line, points_on(line, extent), np.zeros(2), closed)
    return find_twins(state, ends, 1, MergingOptions(), two_sided=False)


def test_what_lies_where_it_lies_is_its_twin() -> None:
    found = twins(LINE + [0.03, 0.005])
    assert found is not None and (found.kept, found.gone) == (0, 1)
    assert found.difference == pytest.approx([-0.03, -0.005])


def test_it_may_be_written_the_other_way_about() -> None:
    assert twins(turned_over(LINE + [0.03, 0.005]), (-4.0, 0.0)) is not None


@pytest.mark.parametrize("line", [LINE + [0.3, 0.0], LINE + [0.0, 0.1], LINE + [0.0, np.pi / 2]])
def test_what_is_off_by_more_than_its_sigmas_is_another(line: Array) -> None:
    assert twins(line) is None


def test_what_does_not_lie_beside_it_is_another() -> None:
    assert twins(LINE, (5.0, 9.0)) is None


def test_what_is_known_badly_stays_two() -> None:
    assert twins(LINE, noise=np.diag([0.5, 0.005]) ** 2) is None


def test_far_from_the_origin_it_is_judged_where_it_lies() -> None:
    """A turn of 5 mrad moves r by half a metre, 100 m along; where the two lie they are one."""
    line = LINE + [0.5, 0.005]
    lever = np.array([[1.0, 102.0], [0.0, 1.0]])
    noise = lever @ SIGMA @ lever.T  # of lines known to SIGMA at 102 m along them
    state, ends = LineState(np.zeros(3), np.zeros(0)), EndPoints()
    for one in (line, LINE):
        state.add(one, (), np.zeros((2, 0)), noise)
        extent = np.array([100.0, 104.0])
        ends.add(one, points_on(one, extent), np.zeros(2), np.zeros(2, dtype=np.bool_))
    assert find_twins(state, ends, 1, MergingOptions(), two_sided=False) is not None
