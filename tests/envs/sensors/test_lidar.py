"""The lidar: exact ranges, then noise of the stated size."""

from dataclasses import replace

import numpy as np
import pytest

from grouser.envs.sensors.lidar import PlanarLidar
from grouser.envs.simulation.robot import RobotModel
from grouser.envs.simulation.robot_rig import robot_rig
from grouser.envs.simulation.world import Boxes, World
from grouser.envs.simulation.worlds.registry import make_world
from grouser.geometry import Array, lift
from grouser.rig import Lidar
from tests.envs.sensors.motions import at_rest, generators

YARD = make_world("yard", np.random.default_rng(0))


def lidar(*, sigma_range: float = 0.0, sigma_bearing: float = 0.0) -> Lidar:
    rig = robot_rig(
        RobotModel(),
        dt=0.1,
        image_size=(64, 48),
        lidar_noise=sigma_range,
        lidar_bearing_noise=sigma_bearing,
        acceleration_noise=0.0,
        rate_noise=0.0,
    )
    assert rig.lidar is not None
    return rig.lidar


def walls_only() -> World:
    s, n = YARD.solids, len(YARD.solids) - YARD.n_walls
    walls = Boxes(s.centre[n:], s.half_extents[n:], s.yaw[n:], s.texture[n:])
    return replace(YARD, solids=walls)


def scans(calibration: Lidar, world: World, pose: tuple[float, float, float], n: int) -> Array:
    sensor = PlanarLidar(calibration)
    sensor.enter(world, generators(1))
    return np.array([sensor.read(at_rest(lift(pose)))["lidar"] for _ in range(n)], np.float64)


@pytest.mark.parametrize("pose", [(2.0, -3.0, 0.7), (8.0, 6.5, -2.0)])
def test_ranges_to_the_walls_are_those_of_a_square_room(pose: tuple[float, float, float]) -> None:
    """Also near a corner, from where the middle of a wall may lie behind a beam that meets it."""
    calibration, (x, y, heading) = lidar(), pose
    ranges = scans(calibration, walls_only(), (x, y, heading), 1)[0]
    angle = calibration.bearings + heading
    with np.errstate(divide="ignore"):
        to_x = np.where(np.cos(angle) > 0, 9 - x, -9 - x) / np.cos(angle)
        to_y = np.where(np.sin(angle) > 0, 9 - y, -9 - y) / np.sin(angle)
    np.testing.assert_allclose(ranges, np.minimum(np.minimum(to_x, to_y), 12.0), rtol=1e-6)


def test_a_beam_that_meets_nothing_reads_the_longest_range() -> None:
    ranges = scans(lidar(sigma_range=0.05), walls_only(), (-8.0, 0.0, 0.0), 3)
    assert np.all(ranges[:, 180] == 12.0)  # straight ahead, 17 m to the wall
    assert np.all(ranges[:, 0] < 2.0)  # straight behind


def test_range_noise_has_the_stated_size() -> None:
    ranges = scans(lidar(sigma_range=0.02), walls_only(), (0.0, 0.0, 0.0), 400)
    ahead = ranges[:, 180]
    assert ahead.std() == pytest.approx(0.02, rel=0.1)
    assert abs(ahead.mean() - 9.0) < 4 * 0.02 / 20


def test_bearing_noise_shows_on_slanted_walls_only() -> None:
    ranges = scans(lidar(sigma_bearing=0.01), walls_only(), (0.0, 0.0, 0.0), 400)
    slanted = np.searchsorted(lidar().bearings, np.radians(30))
    bearing = lidar().bearings[slanted]
    slope = 9 * np.tan(bearing) / np.cos(bearing)  # of the range over the bearing
    assert ranges[:, slanted].std() == pytest.approx(0.01 * slope, rel=0.1)
    assert ranges[:, 180].std() < 1e-3


def test_readings_stay_within_the_space() -> None:
    calibration = lidar(sigma_range=5.0)
    ranges = scans(calibration, YARD, tuple(YARD.start.tolist()), 5)
    space = PlanarLidar(calibration).spaces["lidar"]
    assert ranges.min() == pytest.approx(0.05) and ranges.max() == pytest.approx(12.0)
    assert space.contains(ranges[0].astype(np.float32))
