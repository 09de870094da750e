"""The waypoint driver goes where its estimate says; what it truly missed is told apart."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from grouser.agents.scripted import TOP_SPEED
from grouser.agents.waypoints import SQUARE, WaypointDriver, action_toward, waypoint_misses
from grouser.estimators.base import PoseEstimate, Status
from grouser.geometry import Array, compose, exp
from grouser.rig import Rig, TrackGeometry

RIG = Rig(dt=0.1, tracks=TrackGeometry(gauge=0.4, width=0.08, effective_width=0.55))
coordinates = st.floats(-5, 5)
points = st.tuples(coordinates, coordinates)


def estimate(x: float, y: float, heading: float, status: Status = Status.TRACKING) -> PoseEstimate:
    return PoseEstimate(np.array([x, y, heading]), np.eye(3), status, stamp=0.0)


def follow(driver: WaypointDriver, bias: float = 0.0, steps: int = 800) -> Array:
    """True poses (N, 3) of a robot whose estimate is off by `bias` rad of heading per metre."""
    pose = believed = np.zeros(3)
    poses = [pose]
    for _ in range(steps):
        action = driver(estimate(*believed))
        if action is None:
            break
        left, right = action * TOP_SPEED * RIG.dt
        ahead = (left + right) / 2
        turn = (right - left) / 0.55
        pose = compose(pose, exp([ahead, 0.0, turn]))
        believed = compose(believed, exp([ahead, 0.0, turn + bias * ahead]))
        poses.append(pose)
    return np.array(poses)


def test_a_robot_that_knows_where_it_is_gets_everywhere() -> None:
    driver = WaypointDriver(RIG)
    poses = follow(driver)
    assert driver.targets[-1] == len(SQUARE), "it arrived"
    assert len(poses) < 400
    assert max(waypoint_misses(driver.waypoints, poses, driver.targets)) <= 0.15
    assert np.linalg.norm(poses[:, :2], axis=1).max() < 3.3


def test_a_robot_that_errs_misses_and_the_misses_grow() -> None:
    driver = WaypointDriver(RIG)
    poses = follow(driver, bias=0.03)
    assert driver.targets[-1] == len(SQUARE), "it believes that it arrived"
    misses = waypoint_misses(driver.waypoints, poses, driver.targets)
    assert misses[-1] > 0.25 > misses[0]


def test_a_lost_robot_stands_still_and_does_not_arrive() -> None:
    driver = WaypointDriver(RIG, [(0.05, 0.0), (1.0, 0.0)])
    action = driver(estimate(0, 0, 0, Status.LOST))
    np.testing.assert_array_equal(action, [0, 0])
    assert driver.targets == [0]
    assert driver(estimate(0, 0, 0, Status.COASTING)) is not None
    assert driver.targets == [0, 1], "it goes on as soon as it knows again"


def test_straight_ahead_is_straight() -> None:
    left, right = action_toward(estimate(1, 1, np.pi / 2), np.array([1.0, 3.0]), RIG)
    assert left == pytest.approx(right)
    assert left * TOP_SPEED == pytest.approx(0.36)


def test_behind_is_a_turn_on_the_spot() -> None:
    left, right = action_toward(estimate(0, 0, 0), np.array([-2.0, 0.5]), RIG)
    assert left == pytest.approx(-right)
    assert right > 0, "the shorter way is to the left"


def bearing_of(
    position: tuple[float, float], waypoint: tuple[float, float], heading: float
) -> float:
    return float(np.arctan2(waypoint[1] - position[1], waypoint[0] - position[0]) - heading)


@given(points, points, st.floats(-3, 3))
def test_the_mirror_image_is_driven_with_the_tracks_swapped(
    position: tuple[float, float], waypoint: tuple[float, float], heading: float
) -> None:
    action = action_toward(estimate(*position, heading), np.array(waypoint), RIG)
    mirror = np.array([1, -1])
    mirrored = action_toward(
        estimate(position[0], -position[1], -heading), np.array(waypoint) * mirror, RIG
    )
    if np.cos(bearing_of(position, waypoint, heading)) > -0.999999:  # behind, both ways do
        np.testing.assert_allclose(mirrored, action[::-1], atol=1e-9)
    assert np.abs(action).max() <= 1


@given(points, points, st.floats(-3, 3), points, st.floats(-3, 3))
def test_the_action_depends_on_where_the_waypoint_is_seen_from_the_robot(
    position: tuple[float, float],
    waypoint: tuple[float, float],
    heading: float,
    origin: tuple[float, float],
    turn: float,
) -> None:
    if np.hypot(waypoint[0] - position[0], waypoint[1] - position[1]) < 1e-3:
        return
    action = action_toward(estimate(*position, heading), np.array(waypoint), RIG)
    frame = np.array([*origin, turn])
    pose = compose(frame, [*position, heading])
    moved = compose(frame, [*waypoint, 0.0])[:2]
    bearing = bearing_of(position, waypoint, heading)
    at_switch = abs(np.cos(bearing) - np.cos(np.radians(50))) < 1e-6
    if not at_switch and np.cos(bearing) > -0.999999:
        np.testing.assert_allclose(action_toward(estimate(*pose), moved, RIG), action, atol=1e-6)


def test_misses_count_from_when_the_robot_set_out() -> None:
    """The last waypoint of a round is the start: being there at first is no merit."""
    waypoints = np.array([[1.0, 0.0], [0.0, 0.0]])
    course = np.array([[0, 0, 0], [0.5, 0, 0], [0.9, 0, 0], [0.6, 0.3, 0], [0.3, 0.4, 0]])
    misses = waypoint_misses(waypoints, course, [0, 0, 1, 1, 2])
    np.testing.assert_allclose(misses, [0.1, 0.5])


def test_a_waypoint_that_was_never_set_out_for_counts_from_the_end() -> None:
    waypoints = np.array([[1.0, 0.0], [0.0, 0.0]])
    course = np.array([[0, 0, 0], [0.2, 0, 0], [0.4, 0, 0]], dtype=float)
    np.testing.assert_allclose(waypoint_misses(waypoints, course, [0, 0, 0]), [0.6, 0.4])


def test_waypoints_may_be_an_array() -> None:
    np.testing.assert_array_equal(WaypointDriver(RIG, np.array(SQUARE)).waypoints, SQUARE)


@pytest.mark.parametrize("waypoints", [[(1.0, 0.0, 0.0)], [(np.nan, 0.0)], np.array([1.0, 0.0])])
def test_what_is_no_place_on_the_plane_is_refused(waypoints: Any) -> None:
    with pytest.raises(ValueError, match=r"a waypoint must be two finite numbers x, y \[m\]; got"):
        WaypointDriver(RIG, waypoints)


@pytest.mark.parametrize(
    ("waypoints", "radius"), [([], 0.1), ([(1.0, 0.0)], 0.0), ([(1.0, 0.0)], np.nan)]
)
def test_nonsense_is_refused(waypoints: list[tuple[float, float]], radius: float) -> None:
    with pytest.raises(ValueError, match=r"at least one waypoint and a positive arrival radius"):
        WaypointDriver(RIG, waypoints, arrival_radius=radius)
