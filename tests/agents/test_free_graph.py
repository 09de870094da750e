"""Ways on free space: as long as they are, around what is blocked, and taut where pulled."""

import numpy as np
import pytest

from grouser.agents.free_graph import Ways, clear_graph, grid_graph, pulled_taut
from grouser.envs.simulation.worlds.reachability import FreeSpace
from grouser.geometry import Array


def open_square(side: int = 41) -> FreeSpace:
    return FreeSpace(np.ones((side, side), dtype=bool), 0.1, np.array([-2.0, -2.0]))


def ways(space: FreeSpace) -> Ways:
    return Ways(space, grid_graph(space), np.zeros(2))


def length(way: Array) -> float:
    return float(np.linalg.norm(np.diff(way, axis=0), axis=1).sum())


def test_along_the_grid_and_its_diagonals_lengths_are_exact() -> None:
    found = ways(open_square())
    assert found.length(np.zeros(2)) == 0
    assert found.length(np.array([1.5, 0.0])) == pytest.approx(1.5)
    assert found.length(np.array([-1.2, 1.2])) == pytest.approx(1.2 * np.sqrt(2))


def test_elsewhere_they_exceed_the_straight_line_by_at_most_eight_percent() -> None:
    found, places = ways(open_square()), open_square().points()
    straight = np.linalg.norm(places, axis=1)
    lengths = np.array([found.length(place) for place in places])
    assert (lengths >= straight - 1e-9).all()
    assert (lengths <= 1.0824 * straight + 1e-9).all()  # of 22.5 degrees


def test_pulled_taut_they_are_straight_lines_in_the_open() -> None:
    found = ways(open_square())
    for place in open_square().points()[::7]:
        assert found.taut_length(place) == pytest.approx(np.linalg.norm(place))


def test_pulled_taut_a_way_stays_in_free_space_and_keeps_its_ends() -> None:
    rng = np.random.default_rng(0)
    space = open_square()
    space.free[:] = rng.random(space.free.shape) > 0.1
    space.free[20, 20] = True
    found = ways(space)
    for place in space.points()[::11]:
        if np.isfinite(found.length(place)):
            way = np.concatenate([np.zeros((1, 2)), found.points(place)])
            taut = pulled_taut(space, way)
            assert np.array_equal(taut[[0, -1]], way[[0, -1]])
            assert length(taut) <= length(way) + 1e-9
            lines = zip(taut, taut[1:], strict=False)
            along = np.concatenate([np.linspace(a, b, 30) for a, b in lines])
            beside = along[:, None] + 1e-6 * np.array([[1, 1], [1, -1], [-1, 1], [-1, -1]])
            assert space.at(beside).any(axis=1).all()  # it may touch the corner of a blocked cell


def test_a_way_does_not_cut_corners() -> None:
    space = open_square()
    space.free[:21, 21] = False  # a wall up to the middle row
    assert ways(space).length(np.array([0.2, 0.0])) == pytest.approx(0.4)


def test_a_clear_way_keeps_off_a_wall_where_there_is_room() -> None:
    space = open_square()
    space.free[:20, :] = False  # everything below y = 0
    ends = np.array([-1.8, 0.0]), np.array([1.8, 0.0])
    short, clear = (Ways(space, graph(space), ends[0]) for graph in (grid_graph, clear_graph))
    assert short.points(ends[1])[:, 1].max() == pytest.approx(0.0)
    assert clear.points(ends[1])[:, 1].max() > 0.3


def test_what_is_walled_in_is_infinitely_far() -> None:
    space = open_square()
    space.free[:, 25] = False
    assert ways(space).length(np.array([1.5, 0.0])) == np.inf
    assert ways(space).taut_length(np.array([1.5, 0.0])) == np.inf
