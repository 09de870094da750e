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
from tests.envs.sensors.motions import at_rest, quiet, readings

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
