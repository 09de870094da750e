"""Each scan once, straightened and levelled, whatever comes between."""

from typing import Any

import numpy as np
import pytest

from grouser.estimators.inclination import GRAVITY
from grouser.estimators.line_slam.scan_stream import ScanStream
from grouser.geometry import Array, rotation_from_rpy, transform
from grouser.rig import Imu, Rig
from tests.estimators.line_slam.walls import ROOM, lidar, polygon, ranges_along

SENSOR = lidar(mount=transform(np.eye(3), [0.0, 0.0, 0.45]))
RIG = Rig(dt=0.1, lidar=SENSOR, imu=Imu(sigma_acceleration=0.05, sigma_rate=0.002))
PITCH_RATE = 0.2
"""rad/s: the nose goes down"""


def seen_at(step: int) -> dict[str, Array]:
    """Of a robot that tips over its toes, without noise."""
    R = rotation_from_rpy(0.0, 0.1 * PITCH_RATE * step, 0.0)
    bearings = SENSOR.bearings
    beams = np.stack([np.cos(bearings), np.sin(bearings), 0 * bearings], -1) @ R.T
    origins = np.tile((R @ [0, 0, 0.45])[:2], (SENSOR.n_beams, 1))
    flat = ranges_along(polygon(ROOM), origins, np.arctan2(beams[:, 1], beams[:, 0]))
    rate = PITCH_RATE if step else 0.0
    return {
        "lidar": (flat / np.hypot(beams[:, 0], beams[:, 1])).astype(np.float32),
        "imu": np.array([*(R.T @ [0, 0, GRAVITY]), 0.0, rate, 0.0]),
        "stamp": np.array([0.1 * step]),
    }


def off_walls(stream: ScanStream, observation: dict[str, Any]) -> float:
    """m, the worst return."""
    scan = stream.next(observation, np.zeros(3))
    assert scan is not None
    low, high = ROOM.min(axis=0), ROOM.max(axis=0)
    points = scan.points
    return float(np.abs(np.minimum(points - low, high - points)).min(axis=1).max())


def test_a_robot_that_tips_sees_walls_where_they_are_as_long_as_an_imu_tells() -> None:
    stream, without = ScanStream(RIG, seen_at(0)), ScanStream(Rig(dt=0.1, lidar=SENSOR), seen_at(0))
    for step in range(5):
        off = off_walls(stream, seen_at(step)), off_walls(without, seen_at(step))
        assert off[0] < 2e-3
    assert off[1] > 0.03


def test_a_scan_comes_once_and_the_tilt_is_followed_between_scans() -> None:
    stream = ScanStream(RIG, seen_at(0))
    assert stream.next(seen_at(0)) is not None
    for step in range(1, 4):
        assert stream.next(seen_at(step) | {"lidar_stamp": np.zeros(1)}) is None
    assert off_walls(stream, seen_at(4)) < 2e-3


def test_a_scan_of_the_past_is_not_levelled_by_the_tilt_of_now() -> None:
    stream = ScanStream(RIG, seen_at(0))
    stream.next(seen_at(0))
    stream.next(seen_at(1))
    late = seen_at(2) | {"lidar": seen_at(0)["lidar"], "lidar_stamp": np.array([0.05])}
    assert off_walls(stream, late) < 1e-5


def test_without_a_lidar_there_is_no_stream() -> None:
    with pytest.raises(ValueError, match=r"a stream of scans needs rig\.lidar, and this rig has N"):
        ScanStream(Rig(dt=0.1), seen_at(0))
