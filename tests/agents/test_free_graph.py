"""Ways on free space: as long as they are, and around what is blocked."""

import numpy as np
import pytest

from grouser.agents.free_graph import WayField
from grouser.envs.simulation.worlds.reachability import FreeSpace


def open_square(side: int = 41) -> FreeSpace:
    return FreeSpace(np.ones((side, side), dtype=bool), 0.1, np.array([-2.0, -2.0]))


def test_along_the_grid_and_its_diagonals_lengths_are_exact() -> None:
    field = WayField(open_square(), np.zeros(2))
    assert field.length(np.zeros(2)) == 0
    assert field.length(np.array([1.5, 0.0])) == pytest.approx(1.5)
    assert field.length(np.array([-1.2, 1.2])) == pytest.approx(1.2 * np.sqrt(2))


def test_elsewhere_they_exceed_the_straight_line_by_at_most_eight_percent() -> None:
    field = WayField(open_square(), np.zeros(2))
    places = open_square().points()
    straight = np.linalg.norm(places, axis=1)
    lengths = np.array([field.length(place) for place in places])
    assert (lengths >= straight - 1e-9).all()
    assert (lengths <= 1.0824 * straight + 1e-9).all()  # of 22.5 degrees


def test_a_way_does_not_cut_corners() -> None:
    space = open_square()
    space.free[:21, 21] = False  # a wall up to the middle row
    field = WayField(space, np.array([0.0, 0.0]))
    assert field.length(np.array([0.2, 0.0])) == pytest.approx(0.4)


def test_what_is_walled_in_is_infinitely_far() -> None:
    space = open_square()
    space.free[:, 25] = False
    field = WayField(space, np.zeros(2))
    assert field.length(np.array([1.5, 0.0])) == np.inf
