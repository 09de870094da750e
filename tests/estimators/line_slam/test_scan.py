"""Beams in the robot's frame: what says nothing, whatever the mount, and a robot that moves."""

from dataclasses import replace

import numpy as np
import pytest

from grouser.estimators.line_slam.scan import ScanReader, Sweep
from grouser.geometry import exp, inverse, log, rotation_from_rpy, transform
from tests.estimators.line_slam.walls import ROOM, lidar, mounted, polygon, seen

ROOM_WALLS = polygon(ROOM)


def off_walls(points: np.ndarray) -> float:
    """m; how far points are from the nearest wall of the room, at most."""
    low, high = ROOM.min(axis=0), ROOM.max(axis=0)
    return float(np.abs(np.minimum(points - low, high - points)).min(axis=1).max())


def test_what_met_nothing_and_what_says_nothing_are_no_returns() -> None:
    sensor = lidar(8, range_max=10.0)
    ranges = np.array([1.0, 0.0, np.nan, np.inf, 10.0, -np.inf, 0.05, 9.9])
    scan = ScanReader(sensor).read(ranges.astype(np.float32))
    np.testing.assert_array_equal(scan.hit, [1, 0, 0, 0, 0, 0, 0, 1])
    np.testing.assert_array_equal(np.isinf(scan.ranges), [0, 0, 0, 1, 1, 0, 0, 0])
    assert scan.points.shape == (2, 2)


def test_float32_of_the_longest_range_is_no_return() -> None:
    sensor = lidar(4, range_max=29.9)
    assert not ScanReader(sensor).read(np.full(4, 29.9, dtype=np.float32)).hit.any()


def test_points_lie_on_the_walls_whatever_the_mount() -> None:
    sensor = lidar(mount=mounted(0.3, -0.2, 0.7))
    points = ScanReader(sensor).read(seen(ROOM_WALLS, sensor)).points
    assert off_walls(points) < 1e-12


def test_beams_are_counter_clockwise_even_upside_down() -> None:
    upright = lidar(fov=3.0, start=-1.0, mount=mounted(0.1, 0.0))
    mount = transform(rotation_from_rpy(np.pi, 0.0, 0.0), [0.1, 0.0, 0.3])
    hanging = lidar(fov=3.0, start=-2.0 + 3.0 / 360, mount=mount)
    ranges = seen(ROOM_WALLS, upright)
    a, b = ScanReader(upright).read(ranges), ScanReader(hanging).read(ranges[::-1])
    np.testing.assert_allclose(a.points, b.points, atol=1e-12)
    np.testing.assert_allclose(a.turns, b.turns, atol=1e-12)


def test_who_knows_the_motion_sees_as_if_standing() -> None:
    sensor = lidar(mount=mounted(0.2, 0.1, 0.3))
    motion = np.array([0.25, 0.03, 0.4])
    when = np.linspace(-1.0, 0.0, sensor.n_beams)[:, None]
    ranges = seen(ROOM_WALLS, sensor, exp(when * log(motion)))
    reader = ScanReader(sensor)
    assert off_walls(reader.read(ranges, motion).points) < 1e-12
    assert off_walls(reader.read(ranges).points) > 0.1
    assert off_walls(reader.read(ranges, inverse(motion)).points) > 0.1


@pytest.mark.parametrize(
    ("n", "increment_degrees", "full"),
    [(360, 1.0, True), (361, 1.0, True), (360, 0.999, True), (359, 1.0, False), (180, 1.0, False)],
)
def test_which_scans_are_a_full_turn(n: int, increment_degrees: float, full: bool) -> None:
    sensor = lidar(n, fov=n * np.radians(increment_degrees))
    assert ScanReader(sensor).full_turn is full


def test_a_scan_of_another_lidar_is_refused() -> None:
    with pytest.raises(ValueError, match=r"must have 360 ranges, one a beam, got .* \(180,\)"):
        ScanReader(lidar()).read(np.ones(180))


def test_a_sweep_is_the_part_of_the_motion_that_it_lasts() -> None:
    step = np.array([0.05, 0.01, 0.08])
    sweep = Sweep(replace(lidar(), sweep_time=0.05))
    assert sweep.motion(0.0, step) is None  # nobody knows for how long it moved
    half = sweep.motion(0.1, step)
    assert half is not None
    np.testing.assert_allclose(log(half), log(step) / 2, atol=1e-12)
    assert sweep.motion(0.1, step) is None and sweep.motion(0.2, None) is None
    long = sweep.motion(0.4, step)
    assert long is not None
    np.testing.assert_allclose(log(long), log(step) / 4, atol=1e-12)


def test_a_lidar_without_duration_does_not_sweep() -> None:
    sweep = Sweep(lidar())
    assert sweep.motion(0.0, None) is None and sweep.motion(0.1, np.ones(3)) is None
    with pytest.raises(ValueError, match="Lidar.sweep_time must be zero or more"):
        replace(lidar(), sweep_time=-0.1)
