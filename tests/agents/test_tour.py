"""A tour goes through all goals, stays where the robot fits, and takes no needless way round."""

import numpy as np
import pytest

from grouser.agents.tour import SPACING, plan_tour
from grouser.envs.simulation.ground import Ground
from grouser.envs.simulation.world import Boxes, World
from grouser.envs.simulation.worlds.reachability import free_space
from grouser.envs.simulation.worlds.registry import make_world, world_names
from grouser.geometry import Array


def box_world(goals: list[tuple[float, float]], *boxes: tuple[float, float, float, float]) -> World:
    """Boxes (x, y, half length, half width) on a level square of 12 m; the robot at its centre."""
    n = len(boxes)
    placed = np.array(boxes, dtype=np.float64).reshape(n, 4)
    return World(
        name="test",
        solids=Boxes(
            np.column_stack([placed[:, :2], np.full(n, 0.5)]),
            np.column_stack([placed[:, 2:], np.full(n, 0.5)]),
            np.zeros(n),
            np.zeros(n, dtype=np.int64),
        ),
        n_walls=0,
        ground=Ground.flat(6.0),
        start=np.zeros(3),
        clear_radius=1.0,
        goals=np.array(goals, dtype=np.float64).reshape(-1, 2),
    )


def length(way: Array) -> float:
    return float(np.linalg.norm(np.diff(way, axis=0), axis=1).sum())


@pytest.mark.parametrize("name", world_names())
@pytest.mark.parametrize("seed", range(3))
def test_it_visits_every_goal_of_every_world_within_its_free_space(name: str, seed: int) -> None:
    world = make_world(name, np.random.default_rng(seed))
    tour = plan_tour(world)
    away = np.linalg.norm(tour[:, None] - world.goals, axis=-1)
    assert away.min(axis=0).max() < SPACING
    assert np.linalg.norm(np.diff(tour, axis=0, prepend=world.start[None, :2]), axis=1).max() < (
        1.5 * SPACING
    )
    assert free_space(world, radius=0.3).at(tour).all()


def test_in_the_open_it_goes_straight() -> None:
    tour = plan_tour(box_world([(4.0, 0.0)]))
    assert np.allclose(tour[-1], [4, 0])
    assert length(np.concatenate([np.zeros((1, 2)), tour])) == pytest.approx(4.0, rel=0.03)


def test_it_goes_around_a_wall() -> None:
    tour = plan_tour(box_world([(4.0, 0.0)], (2.0, -1.0, 0.1, 3.0)))
    assert free_space(box_world([], (2.0, -1.0, 0.1, 3.0))).at(tour).all()
    assert 5.0 < length(tour) < 9.0


def test_the_nearest_goal_comes_first() -> None:
    tour = plan_tour(box_world([(-4.0, 0.0), (1.5, 0.0), (3.0, 0.0)]))
    first = [int(np.argmin(np.linalg.norm(tour - goal, axis=1))) for goal in [(1.5, 0), (3, 0)]]
    assert first == sorted(first) and first[1] < len(tour) - 1


def test_a_world_without_goals_is_refused() -> None:
    with pytest.raises(ValueError, match="the world 'test' has no goals to drive to"):
        plan_tour(box_world([]))


def test_a_goal_behind_a_closed_wall_is_refused() -> None:
    world = box_world([(1.5, 0.0), (4.0, 0.0)], (2.5, 0.0, 0.1, 6.0))
    with pytest.raises(ValueError, match=r"cannot drive from .* to any of the goals .*4.*'test'"):
        plan_tour(world)
