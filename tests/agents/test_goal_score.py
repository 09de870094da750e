"""Progress adds up to the way gained; outcomes and what is told follow the truth alone."""

import math
from typing import Any

import numpy as np
import pytest

from grouser.agents.goal_score import (
    COLLISION,
    MISSED,
    REACHED,
    RUNNING,
    SUCCESS,
    TIMEOUT,
    GoalScore,
    Reward,
)
from grouser.envs.simulation.ground import Ground
from grouser.envs.simulation.world import Boxes, World
from grouser.geometry import Array

WALL = (2.0, -1.0, 0.1, 3.0)


def walled(start: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> World:
    """A wall from y = -4 to 2 at x = 2, on a level square of 12 m."""
    x, y, length, width = WALL
    return World(
        name="test",
        solids=Boxes(
            np.array([[x, y, 0.5]]), np.array([[length, width, 0.5]]), np.zeros(1), np.zeros(1, int)
        ),
        n_walls=0,
        ground=Ground.flat(6.0),
        start=np.array(start),
        clear_radius=1.0,
        goals=np.zeros((0, 2)),
    )


def truth(x: float, y: float, *, collision: bool = False) -> dict[str, Any]:
    return {"true_pose": np.array([x, y, 0.0]), "collision": collision}


def around(goal: Array) -> GoalScore:
    return GoalScore(walled(), np.atleast_2d(goal))


def test_the_shortest_way_goes_around_the_wall() -> None:
    # Straight to the circle of the robot's radius around the corner (1.9, 2), along it, across.
    radius, corner = 0.4, math.hypot(1.9, 2.0)
    straight = math.sqrt(corner**2 - radius**2)
    leaves = math.atan2(2.0, 1.9) + math.asin(radius / corner)  # rad from the x axis
    least = 2 * (straight + radius * leaves) + 0.2
    shortest = around(np.array([4.0, 0.0])).shortest_path
    assert least - 0.1 < shortest < 1.02 * least + 0.1  # cells of 0.1 m


def test_progress_adds_up_to_the_way_gained() -> None:
    score = around(np.array([4.0, 0.0]))
    way = [(0.5, 0.8), (1.0, 1.9), (2.0, 2.6), (1.5, 2.6), (3.0, 2.0), (4.0, 0.0)]
    at_first = score.remaining_path
    gained = [score.advance(truth(*place)) for place in way]
    assert sum(gained) == pytest.approx(at_first)
    assert score.remaining_path == 0 and gained[3] < 0 < min(gained[:3])
    lengths = np.linalg.norm(np.diff([(0, 0), *way], axis=0), axis=1)
    assert score.path_length == pytest.approx(lengths.sum())


def test_goals_are_given_in_the_frame_of_the_start() -> None:
    turned = GoalScore(walled(start=(0.0, 4.0, -math.pi / 2)), np.array([[4.0, 4.0]]))
    straight = GoalScore(walled(), np.array([[4.0, 0.0]]))
    turned.advance(truth(4.0, 0.0))  # the place of the other's start
    straight.advance(truth(0.0, 0.0))
    assert turned.remaining_path == pytest.approx(straight.remaining_path, abs=0.11)


def test_a_place_without_a_way_leaves_the_length_as_it_was() -> None:
    score = around(np.array([4.0, 0.0]))
    assert score.advance(truth(2.0, 0.0)) == 0.0
    assert score.remaining_path == around(np.array([4.0, 0.0])).remaining_path


@pytest.mark.parametrize(
    ("place", "collision", "stopped", "late", "outcome"),
    [
        ((1.0, 0.0), False, False, False, RUNNING),
        ((1.0, 0.0), False, False, True, TIMEOUT),
        ((1.0, 0.0), False, True, False, MISSED),
        ((1.0, 0.0), True, True, True, COLLISION),
        ((4.0, 0.29), False, True, True, SUCCESS),
        ((4.0, 0.31), False, True, False, MISSED),
        ((4.0, 0.0), True, True, False, COLLISION),
    ],
)
def test_outcomes(
    place: tuple[float, float], collision: bool, stopped: bool, late: bool, outcome: str
) -> None:
    score = around(np.array([4.0, 0.0]))
    now = truth(*place, collision=collision)
    score.advance(now)
    assert score.judge(now, stopped=stopped, out_of_time=late) == outcome
    said = score.said(outcome, 0.25)
    assert said["is_success"] == (outcome == SUCCESS)
    assert said["distance_to_goal"] == pytest.approx(math.dist(place, (4.0, 0.0)))
    assert said["believed_distance_to_goal"] == 0.25


def test_goals_come_one_after_another() -> None:
    score = GoalScore(walled(), np.array([[1.0, 0.0], [1.0, 2.0], [0.0, 2.0]]))
    assert score.shortest_path == pytest.approx(4.0, abs=0.05)
    outcomes, left = [], []
    for goal in [(1.0, 0.0), (1.0, 2.0), (0.0, 2.0)]:
        assert tuple(score.goal) == goal
        score.advance(truth(*goal))
        outcomes.append(score.judge(truth(*goal), stopped=True, out_of_time=False))
        left.append(score.remaining_path)
        assert score.said(outcomes[-1], 0.0)["distance_to_goal"] == 0
    assert outcomes == [REACHED, REACHED, SUCCESS]
    assert left == pytest.approx([3.0, 1.0, 0.0], abs=0.05)
    assert score.said(SUCCESS, 0.0)["goals_reached"] == 3
    assert score.said(SUCCESS, 0.0)["progress"] == 1


def test_rewards_are_progress_step_and_end() -> None:
    reward = Reward(progress=2.0, step=-0.5, success=10.0, missed=-3.0, collision=-7.0)
    assert reward.of(0.25, RUNNING) == 0.0
    assert reward.of(0.0, TIMEOUT) == -0.5
    assert [reward.of(0.25, end) for end in (SUCCESS, REACHED, MISSED, COLLISION)] == [
        10.0,
        10.0,
        -3.0,
        -7.0,
    ]
