"""The lidar: exact ranges, then noise of the stated size."""

from dataclasses import replace

import numpy as np
import pytest

from grouser.envs.sensors.lidar import PlanarLidar
from grouser.envs.simulation.robot import RobotModel
from grouser.envs.simulation.robot_rig import robot_rig
from grouser.envs.simulation.world import Boxes, World
from grouser.envs.simulation.worlds.registry import make_world
from grouser.geometry import Array, lift, project
from tests.envs.sensors.motions import at_rest, drive, quiet, readings

YARD = make_world("yard", np.random.default_rng(0))
START = (float(YARD.start[0]), float(YARD.start[1]), float(YARD.start[2]))


RIG = robot_rig(RobotModel(), dt=0.1, image_size=(64, 48), amounts=quiet())
assert RIG.lidar is not None
LIDAR = RIG.lidar


def walls_only() -> World:
    s, n = YARD.solids, len(YARD.solids) - YARD.n_walls
    walls = Boxes(s.centre[n:], s.half_extents[n:], s.yaw[n:], s.texture[n:])
    return replace(YARD, solids=walls)


def scans(world: World, pose: tuple[float, float, float], n: int = 1, **effects: float) -> Array:
    """(n, beams) m."""
    amounts = quiet({f"lidar.{name}": amount for name, amount in effects.items()})
    read = readings(PlanarLidar(LIDAR), world, [at_rest(lift(pose))] * n, amounts, seed=1)
    return np.array([reading["lidar"] for reading in read], np.float64)


@pytest.mark.parametrize("pose", [(2.0, -3.0, 0.7), (8.0, 6.5, -2.0)])
def test_ranges_to_the_walls_are_those_of_a_square_room(pose: tuple[float, float, float]) -> None:
    """Also near a corner, from where the middle of a wall may lie behind a beam that meets it."""
    x, y, heading = pose
    ranges = scans(walls_only(), pose)[0]
    angle = LIDAR.bearings + heading
    with np.errstate(divide="ignore"):
        to_x = np.where(np.cos(angle) > 0, 9 - x, -9 - x) / np.cos(angle)
        to_y = np.where(np.sin(angle) > 0, 9 - y, -9 - y) / np.sin(angle)
    np.testing.assert_allclose(ranges, np.minimum(np.minimum(to_x, to_y), 12.0), rtol=1e-6)


def test_a_beam_that_meets_nothing_reads_the_longest_range() -> None:
    ranges = scans(walls_only(), (-8.0, 0.0, 0.0), 3, range_noise=0.05)
    assert np.all(ranges[:, 180] == 12.0)  # straight ahead, 17 m to the wall
    assert np.all(ranges[:, 0] < 2.0)  # straight behind


def test_range_noise_has_the_stated_size() -> None:
    ahead = scans(walls_only(), (0.0, 0.0, 0.0), 400, range_noise=0.02)[:, 180]
    assert ahead.std() == pytest.approx(0.02, rel=0.1)
    assert abs(ahead.mean() - 9.0) < 4 * 0.02 / 20


def test_bearing_noise_shows_on_slanted_walls_only() -> None:
    ranges = scans(walls_only(), (0.0, 0.0, 0.0), 400, bearing_noise=0.01)
    slanted = np.searchsorted(LIDAR.bearings, np.radians(30))
    bearing = LIDAR.bearings[slanted]
    slope = 9 * np.tan(bearing) / np.cos(bearing)  # of the range over the bearing
    assert ranges[:, slanted].std() == pytest.approx(0.01 * slope, rel=0.1)
    assert ranges[:, 180].std() < 1e-3


def test_readings_stay_within_the_space() -> None:
    ranges = scans(YARD, START, 5, range_noise=5.0)
    space = PlanarLidar(LIDAR).spaces["lidar"]
    assert ranges.min() == pytest.approx(0.05) and ranges.max() == pytest.approx(12.0)
    assert space.contains(ranges[0].astype(np.float32))


def test_quantised_ranges_are_whole_steps() -> None:
    exact, coarse = scans(YARD, START)[0], scans(YARD, START, quantisation=0.25)[0]
    hit = exact < 12.0
    np.testing.assert_allclose(coarse[hit] / 0.25, np.round(coarse[hit] / 0.25), atol=1e-6)
    assert np.abs(coarse - exact).max() <= 0.125 + 1e-6


def test_the_share_of_beams_that_return_nothing_is_the_one_stated() -> None:
    exact, lossy = scans(YARD, START)[0], scans(YARD, START, 200, dropout=0.1)
    hit = exact < 12.0
    assert np.mean(lossy[:, hit] == 12.0) == pytest.approx(0.1, rel=0.05)
    kept = lossy < 12.0
    assert np.array_equal(lossy[kept], np.broadcast_to(exact, lossy.shape)[kept])


def test_nothing_returns_from_beyond_the_range_that_is_left() -> None:
    exact, short = scans(YARD, START)[0], scans(YARD, START, range_loss=0.5)[0]
    np.testing.assert_array_equal(short, np.where(exact < 6.0, exact, 12.0))
    assert 0 < np.mean(short < 12.0) < 1


def test_mixed_pixels_lie_between_what_the_beam_meets() -> None:
    """On the edges of boxes; elsewhere the beam's width hardly shows."""
    half_width = 0.005
    exact = scans(YARD, START)[0]
    turned = [(START[0], START[1], START[2] + s * half_width) for s in (-1, 1)]
    sides = [scans(YARD, pose)[0] for pose in turned]
    mixed = scans(YARD, START, 30, mixed_pixels=half_width)
    met = np.array([exact, *sides])
    nearest = met.min(axis=0)
    farthest = np.where(met < 12.0, met, nearest).max(axis=0)
    assert np.all((nearest - 1e-5 <= mixed) & (mixed <= farthest + 1e-5))
    edge = farthest - nearest > 0.3
    between = (mixed[:, edge] > nearest[edge] + 0.05) & (mixed[:, edge] < farthest[edge] - 0.05)
    assert edge.sum() >= 5 and between.mean() > 0.4


def test_beams_pass_the_solids_that_are_glass() -> None:
    """All of them when the share is 1; the same ones for a whole episode."""
    empty = replace(YARD, solids=Boxes.none())
    assert np.array_equal(scans(YARD, START, glass=1.0), scans(empty, START))
    some = scans(YARD, START, 2, glass=0.5)
    exact = scans(YARD, START)[0]
    assert np.array_equal(some[0], some[1])
    assert np.all(some[0] >= exact - 1e-6) and np.any(some[0] > exact + 0.5)


def test_a_scan_that_takes_time_is_skewed_by_the_motion() -> None:
    """The last beam is of now; the first as if it were sent when the scan began."""
    world = walls_only()
    motion = drive(world, [(-0.4, 0.4)] * 6)[-1]
    sensor = PlanarLidar(LIDAR)
    skewed = readings(sensor, world, [motion], quiet({"lidar.motion_skew": 0.1}))[0]["lidar"]
    for age, beam in ((0.1, 0), (0.05, 180), (0.0, 359)):
        then = replace(motion, T_world_base=motion.pose_at(age))
        instant = readings(sensor, world, [then], quiet())[0]["lidar"]
        assert skewed[beam] == pytest.approx(instant[beam], rel=2e-3)
    turned = project(motion.pose_at(0.0))[2] - project(motion.pose_at(0.1))[2]
    assert turned > 0.05  # it did turn
    now = readings(sensor, world, [motion], quiet())[0]["lidar"]
    assert np.abs(now[0] - skewed[0]) > 1e-3
