"""A policy sees the nearest range of every sector and the goal from the believed pose."""

import math
from typing import Any

import numpy as np
import pytest
from gymnasium import spaces

from grouser.agents.goal_view import GoalView, believed_goal, known_policy_sensors
from grouser.envs.tracked_robot import TrackedRobotEnv
from grouser.estimators.base import PoseEstimate, Status

RIG = TrackedRobotEnv().rig
assert RIG.lidar is not None
N_BEAMS, FARTHEST = RIG.lidar.n_beams, RIG.lidar.range_max
SHOWN = spaces.Dict({"lidar": spaces.Box(0.0, FARTHEST, (N_BEAMS,), np.float32)})


def view(**options: Any) -> GoalView:
    given = {"sensors": ("lidar",), "beams": 36, "normalize": True, "covariance": False, **options}
    return GoalView(RIG, SHOWN, **given)


def estimate(x: float, y: float, heading: float) -> PoseEstimate:
    covariance = np.array([[1.0, 2.0, 3.0], [2.0, 4.0, 5.0], [3.0, 5.0, 6.0]])
    return PoseEstimate(np.array([x, y, heading]), covariance, Status.TRACKING, 0.0)


def seen(made: GoalView, ranges: Any, *pose: float) -> dict[str, Any]:
    shown = {"lidar": np.asarray(ranges, dtype=np.float32)}
    believed = estimate(*(pose or (0.0, 0.0, 0.0)))
    result: dict[str, Any] = {**made.of(shown, believed, np.array([3.0, 4.0]), np.array([1, 0]))}
    assert made.space.contains(result)
    return result


@pytest.mark.parametrize("beams", [1, 7, 36, N_BEAMS])
def test_a_sector_shows_its_nearest_range(beams: int) -> None:
    ranges = np.random.default_rng(0).uniform(0.1, FARTHEST, N_BEAMS)
    shown = seen(view(beams=beams, normalize=False), ranges)["beams"]
    edges = [k * N_BEAMS // beams for k in range(beams + 1)]
    wanted = [ranges[a:b].min() for a, b in zip(edges, edges[1:], strict=False)]
    assert shown == pytest.approx(wanted, rel=1e-6)


def test_normalised_ranges_are_fractions_of_the_longest() -> None:
    assert seen(view(), np.full(N_BEAMS, FARTHEST))["beams"] == pytest.approx(1.0)
    assert seen(view(), np.full(N_BEAMS, FARTHEST / 4))["beams"] == pytest.approx(0.25)


@pytest.mark.parametrize("heading", [0.0, 1.0, -3.0])
def test_the_goal_is_seen_from_the_estimated_pose(heading: float) -> None:
    shown = seen(view(normalize=False), np.ones(N_BEAMS), 1.0, 1.0, heading)["goal"]
    distance, bearing = math.hypot(2, 3), math.atan2(3, 2) - heading
    assert shown == pytest.approx([distance, math.cos(bearing), math.sin(bearing)], abs=1e-6)
    assert seen(view(), np.ones(N_BEAMS), 1.0, 1.0, heading)["goal"][0] == pytest.approx(
        distance / 10
    )


def test_a_bearing_is_wrapped() -> None:
    assert believed_goal(np.array([0, 0, 3.0]), np.array([-1.0, -0.1]))[1] == pytest.approx(
        math.atan2(-0.1, -1.0) - 3.0 + 2 * math.pi
    )


def test_the_covariance_is_seen_where_asked_for() -> None:
    assert "pose_covariance" not in seen(view(), np.ones(N_BEAMS))
    shown = seen(view(covariance=True), np.ones(N_BEAMS))["pose_covariance"]
    assert shown.tolist() == [1, 2, 3, 4, 5, 6]


def test_an_observation_is_new_memory() -> None:
    made, ranges = view(beams=N_BEAMS, normalize=False), np.ones(N_BEAMS, dtype=np.float32)
    first, second = seen(made, ranges), seen(made, ranges)
    for key, value in first.items():
        assert not np.may_share_memory(value, second[key])
        assert not np.may_share_memory(value, ranges)


@pytest.mark.parametrize("beams", [0, N_BEAMS + 1, 3.5])
def test_a_wrong_number_of_beams_is_refused(beams: Any) -> None:
    with pytest.raises(ValueError, match=f"beams must be a whole number from 1 to .* {N_BEAMS}"):
        view(beams=beams)


def test_an_unknown_sensor_is_refused() -> None:
    with pytest.raises(ValueError, match="cannot see 'sonar'; policy_sensors are of: lidar, left"):
        known_policy_sensors(["lidar", "sonar"])
    assert known_policy_sensors(["left", "lidar"]) == ("lidar", "left")
