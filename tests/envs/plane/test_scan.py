"""Rays against an independent solution, and what the nearest segment hides."""

import numpy as np
import pytest

from grouser.envs.plane.scan import cast
from grouser.geometry import Array, rotate


def brute_force(segments: Array, position: Array, direction: float, reach: float) -> float:
    """The 2 x 2 system position + s d = a + t (b - a), segment by segment."""
    d = np.array([np.cos(direction), np.sin(direction)])
    found = [np.inf]
    for a, b in segments.reshape(-1, 2, 2):
        s, t = np.linalg.solve(np.column_stack([d, a - b]), a - position)
        if s >= 0 and 0 <= t <= 1 and s <= reach:
            found.append(s)
    return float(min(found))


def test_ranges_are_those_of_the_linear_equations() -> None:
    rng = np.random.default_rng(0)
    hits = 0
    for _ in range(300):
        segments, position = rng.uniform(-20, 20, (6, 4)), rng.uniform(-20, 20, 2)
        directions = rng.uniform(-np.pi, np.pi, 20)
        told = cast(segments, position, directions, 25.0)
        wanted = [brute_force(segments, position, direction, 25.0) for direction in directions]
        np.testing.assert_allclose(told, wanted, rtol=1e-9, atol=1e-9)
        hits += int(np.isfinite(told).sum())
    assert 1000 < hits < 5500  # both kinds


def test_what_is_near_hides_what_is_behind() -> None:
    near, far = [2.0, -1.0, 2.0, 1.0], [4.0, -8.0, 4.0, 8.0]
    directions = np.array([0.0, np.arctan2(3.0, 4.0), np.pi])
    told = cast(np.array([far, near]), np.zeros(2), directions, 30.0)
    np.testing.assert_allclose(told, [2.0, 5.0, np.inf])


def test_the_reach_is_the_longest_range() -> None:
    wall = np.array([[3.0, -9.0, 3.0, 9.0]])
    assert cast(wall, np.zeros(2), np.zeros(1), 3.0)[0] == 3.0
    assert cast(wall, np.zeros(2), np.zeros(1), 2.999)[0] == np.inf


@pytest.mark.parametrize("turn", [0.3, -2.0])
def test_the_frame_does_not_matter(turn: float) -> None:
    rng = np.random.default_rng(1)
    segments, position = rng.uniform(-20, 20, (6, 4)), rng.uniform(-5, 5, 2)
    directions = np.linspace(-3, 3, 200)
    turned = rotate(turn, segments.reshape(-1, 2) + [7, -3]).reshape(-1, 4)
    there = cast(turned, rotate(turn, position + [7, -3]), directions + turn, 30.0)
    np.testing.assert_allclose(there, cast(segments, position, directions, 30.0), atol=1e-9)
