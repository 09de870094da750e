"""Arcs are the robot's own, their room is that of its hull, and the best of them goes around."""

import math

import numpy as np
import pytest

from grouser.agents.dynamic_window import _HULL, _best, _follow
from grouser.geometry import Array

NOTHING = np.zeros((0, 2))


def followed(seen: Array, goal: Array, speed: float, turn_rate: float) -> tuple[float, float]:
    arcs = _follow(seen, goal, np.array([speed]), np.array([turn_rate]), 0.15, 16, _HULL)
    return float(arcs[0][0, 0]), float(arcs[1][0, 0])


@pytest.mark.parametrize("turn_rate", [0.0, 0.5, -0.5])
def test_an_arc_ends_where_a_circle_does(turn_rate: float) -> None:
    speed, turn = 0.4, turn_rate * 0.15 * 16
    if turn_rate:
        radius = speed / turn_rate
        end = radius * np.array([math.sin(turn), 1 - math.cos(turn)])
    else:
        end = np.array([speed * 0.15 * 16, 0.0])
    nearest, room = followed(NOTHING, end, speed, turn_rate)
    assert nearest < 2e-3 and room == math.inf


def test_room_is_from_the_hulls_sides() -> None:
    point = np.array([[2.0, 0.0]])
    assert followed(point, np.zeros(2), 0.4, 0.0)[1] == pytest.approx(2.0 - 0.96 - _HULL[0])
    beside = np.array([[0.5, 0.6]])
    assert followed(beside, np.zeros(2), 0.4, 0.0)[1] == pytest.approx(0.6 - _HULL[1])
    within = np.array([[0.9, 0.1]])
    assert followed(within, np.zeros(2), 0.4, 0.0)[1] == 0


def test_in_the_open_it_drives_at_the_goal() -> None:
    speed, turn_rate = _best(NOTHING, np.array([3.0, 0.0]))
    assert speed == pytest.approx(0.4) and turn_rate == pytest.approx(0.0)
    assert _best(NOTHING, np.array([1.0, 2.0]))[1] > 0 > _best(NOTHING, np.array([1.0, -2.0]))[1]


def test_it_turns_away_from_an_obstacle_ahead_to_the_side_of_the_goal() -> None:
    post = np.array([[0.9, y] for y in np.linspace(-0.1, 0.1, 5)])
    for side in (1.0, -1.0):
        speed, turn_rate = _best(post, np.array([3.0, side * 0.8]))
        assert speed > 0 and math.copysign(1.0, turn_rate) == side
        assert followed(post, np.zeros(2), speed, turn_rate)[1] >= 0.06


def test_before_a_wall_it_does_not_drive_on() -> None:
    wall = np.array([[_HULL[0] + 0.05, y] for y in np.linspace(-2, 2, 81)])
    assert _best(wall, np.array([3.0, 0.0]))[0] == 0
