"""Beams in the robot's frame: what says nothing, whatever the mount, and a robot that moves."""

from dataclasses import replace

import numpy as np
import pytest

from grouser.estimators.inclination import levelling
from grouser.estimators.line_slam.scan import ScanReader, Sweep
from grouser.geometry import exp, inverse, log, rotation_from_rpy, transform
from grouser.rig import Lidar
from tests.estimators.line_slam.walls import ROOM, lidar, mounted, polygon, ranges_along, seen

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


TILTED = rotation_from_rpy(0.03, 0.09, 0.0)
"""T_start_base's rotation: nose down by five degrees, and over to the right."""
HIGH = transform(np.eye(3), [0.1, 0.0, 0.45])


def tilted_ranges(sensor: Lidar) -> tuple[np.ndarray, np.ndarray]:
    """(n,) of a robot that tilts in a room without a ceiling, and which beams met its floor."""
    R, T = TILTED, sensor.T_base_lidar
    beams = np.stack([np.cos(sensor.bearings), np.sin(sensor.bearings), 0 * sensor.bearings], -1)
    beams, origin = beams @ (R @ T[:3, :3]).T, R @ T[:3, 3]
    origins = np.tile(origin[:2], (sensor.n_beams, 1))
    flat = ranges_along(ROOM_WALLS, origins, np.arctan2(beams[:, 1], beams[:, 0]))
    to_wall = flat / np.hypot(beams[:, 0], beams[:, 1])
    with np.errstate(divide="ignore"):
        to_floor = np.where(beams[:, 2] < 0, -origin[2] / beams[:, 2], np.inf)
    return np.minimum(to_wall, to_floor), to_floor < to_wall


def test_who_knows_which_way_is_up_sees_walls_where_they_are() -> None:
    sensor = lidar(mount=HIGH, range_max=12.0)
    ranges, floor = tilted_ranges(sensor)
    reader, level = ScanReader(sensor), levelling(TILTED[2])
    assert not floor.any(), "it is out of sight in so small a room"
    assert off_walls(reader.read(ranges, None, level).points) < 1e-12
    assert off_walls(reader.read(ranges).points) > 0.03


def test_the_floor_is_no_wall() -> None:
    low = transform(np.eye(3), [0.1, 0.0, 0.2])
    sensor = lidar(mount=low)
    ranges, floor = tilted_ranges(sensor)
    scan = ScanReader(sensor).read(ranges, None, levelling(TILTED[2]))
    assert floor.sum() > 20 and np.isnan(scan.ranges[floor]).all()
    assert off_walls(scan.points) < 1e-12 and scan.hit.sum() > 200


def test_what_met_nothing_below_the_horizon_met_nothing() -> None:
    sensor = lidar(mount=HIGH, range_max=12.0)
    scan = ScanReader(sensor).read(np.full(360, 12.0), None, levelling(TILTED[2]))
    assert np.isinf(scan.ranges).all()


def test_a_level_scan_is_levelled_to_itself() -> None:
    sensor = lidar(mount=mounted(0.3, -0.2, 0.7))
    ranges, motion = seen(ROOM_WALLS, sensor), np.array([0.1, 0.0, 0.2])
    reader = ScanReader(sensor)
    for moved in (None, motion):
        plain, level = reader.read(ranges, moved), reader.read(ranges, moved, np.eye(3))
        np.testing.assert_allclose(plain.points, level.points, atol=1e-12)
        np.testing.assert_allclose(plain.turns, level.turns, atol=1e-12)
