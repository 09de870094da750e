"""The paper's driver: through its waypoints, within what the wheel can do, and not when lost."""

import math

import numpy as np
import pytest

from grouser.agents.steering import SteeringDriver
from grouser.estimators.base import PoseEstimate, Status
from grouser.rig import Rig
from grouser.rig_motion import Steering

RIG = Rig(dt=0.1, steering=Steering(4.0, 3.0, math.radians(30), math.radians(20), 0.0, 0.0))


def at(x: float, y: float, heading: float, status: Status = Status.TRACKING) -> PoseEstimate:
    return PoseEstimate(np.array([x, y, heading]), np.zeros((3, 3)), status, 0.0)


def angle(action: np.ndarray | None) -> float:
    assert action is not None and action[0] == 1.0
    return float(action[1]) * math.radians(30)


def test_the_wheel_turns_towards_the_waypoint_at_its_largest_rate_until_it_points_there() -> None:
    driver = SteeringDriver(RIG, [(100.0, 10.0)])
    wanted = math.atan2(10, 100)
    told = [angle(driver(at(0, 0, 0))) for _ in range(5)]
    np.testing.assert_allclose(told, np.minimum(math.radians(2) * np.arange(1, 6), wanted))
    behind = SteeringDriver(RIG, [(-50.0, -1.0)])
    told = [angle(behind(at(0, 0, 0))) for _ in range(20)]
    assert told[-1] == pytest.approx(-math.radians(30))


def test_the_next_waypoint_comes_within_the_radius_and_none_after_the_last() -> None:
    driver = SteeringDriver(RIG, [(5.0, 0.0), (5.0, 9.0)])
    assert angle(driver(at(3.99, 0, 0))) == pytest.approx(0.0)
    assert angle(driver(at(4.01, 0, 0))) == pytest.approx(math.radians(2))
    assert driver(at(5.0, 8.5, 0)) is None


def test_a_lost_vehicle_stands_still() -> None:
    driver = SteeringDriver(RIG, [(5.0, 0.0)])
    action = driver(at(0, 0, 0, Status.LOST))
    assert action is not None and action[0] == 0.0


@pytest.mark.parametrize(
    ("rig", "waypoints", "radius", "words"),
    [
        (Rig(dt=0.1), [(1, 2)], 1.0, 'needs rig.steering.*motion="steering"'),
        (RIG, [], 1.0, "at least one"),
        (RIG, [(1, 2, 3)], 1.0, "waypoints must be x, y"),
        (RIG, [(1, math.nan)], 1.0, "finite"),
        (RIG, [(1, 2)], 0.0, "arrival_radius must be positive"),
    ],
)
def test_what_cannot_be_driven_is_refused(
    rig: Rig, waypoints: list[tuple[float, ...]], radius: float, words: str
) -> None:
    with pytest.raises(ValueError, match=words):
        SteeringDriver(rig, waypoints, arrival_radius=radius)  # type: ignore[arg-type]
