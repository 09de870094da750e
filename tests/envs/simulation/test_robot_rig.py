"""The rig says what the simulated robot measures."""

from dataclasses import replace

import numpy as np
import pytest

from grouser.envs.sensors.schedule import Schedule
from grouser.envs.simulation.ground import Ground
from grouser.envs.simulation.robot import DYNAMICS, PHYSICS_DT, RobotModel, TrackedRobot
from grouser.envs.simulation.robot_rig import (
    EFFECTIVE_WIDTH,
    effective_width,
    measure_effective_width,
    robot_rig,
)
from grouser.envs.simulation.worlds.registry import make_world
from grouser.rig import Rig


@pytest.fixture(scope="module")
def rig() -> Rig:
    return robot_rig(
        RobotModel(),
        dt=0.1,
        image_size=(320, 240),
        amounts=Schedule({"gps.noise": 0.3, "lidar.motion_skew": 0.05}).steady,
    )


@pytest.mark.parametrize("dynamics", DYNAMICS)
def test_the_effective_width_is_the_one_that_the_robot_shows(dynamics: str) -> None:
    world = make_world("yard", np.random.default_rng(0))
    for speed in (0.2, 0.5):
        measured = measure_effective_width(RobotModel(), world, speed=speed, dynamics=dynamics)
        assert measured == pytest.approx(EFFECTIVE_WIDTH, rel=0.01)


def test_the_effective_width_holds_in_curves_and_on_the_spot() -> None:
    """Within 4 %: the estimators' models of the tracks rely on it."""
    robot = TrackedRobot(RobotModel(), dt=0.1, dynamics="fast")
    world = make_world("yard", np.random.default_rng(0))
    for command in ((0.5, 0.4), (0.5, 0.2), (0.4, 0.0), (0.3, -0.1), (0.25, -0.25)):
        assert effective_width(robot, world, command) == pytest.approx(EFFECTIVE_WIDTH, rel=0.04)


def test_a_robot_that_does_not_turn_has_no_effective_width() -> None:
    robot = TrackedRobot(RobotModel(), dt=0.1, dynamics="fast")
    world = make_world("yard", np.random.default_rng(0))
    with pytest.raises(RuntimeError, match=r"did not turn with its tracks at \(0.2, 0.2\) m/s"):
        effective_width(robot, world, (0.2, 0.2))


def test_the_effective_width_depends_on_the_ground() -> None:
    """The softer, the more motion resistance a turn on the spot has to overcome."""
    world = make_world("yard", np.random.default_rng(0))
    robot = TrackedRobot(RobotModel(), dt=0.1, dynamics="fast")
    asphalt, grass, mud = (
        effective_width(robot, replace(world, ground=Ground.flat(9.3, name)), (-0.25, 0.25))
        for name in ("asphalt", "grass", "mud")
    )
    assert 1.03 * asphalt < grass and 1.03 * grass < mud


def test_the_stereo_pair_straddles_the_centre_line(rig: Rig) -> None:
    assert rig.stereo is not None
    left = rig.stereo.T_base_camera[:3, 3]
    right = left + rig.stereo.baseline * rig.stereo.T_base_camera[:3, 0]
    np.testing.assert_allclose((left + right) / 2, [0.20, 0.0, 0.40], atol=1e-12)
    assert rig.stereo.T_base_camera[2, 2] == pytest.approx(-np.sin(np.radians(10)))  # looks down


def test_the_lidar_looks_all_round(rig: Rig) -> None:
    assert rig.lidar is not None
    assert rig.lidar.bearings[0] == pytest.approx(-np.pi)
    assert rig.lidar.bearings[-1] == pytest.approx(np.pi - rig.lidar.angle_increment)
    assert rig.lidar.T_base_lidar[2, 3] > RobotModel().hull_top  # and does not see the robot


def test_a_control_step_is_24_physics_steps(rig: Rig) -> None:
    assert rig.dt / PHYSICS_DT == pytest.approx(24)


def test_the_rig_states_the_noises_that_hold_all_the_time(rig: Rig) -> None:
    assert rig.lidar is not None and rig.imu is not None and rig.gps is not None
    assert (rig.lidar.sigma_range, rig.lidar.sigma_bearing) == (0.01, 0.001)
    assert (rig.imu.sigma_acceleration, rig.imu.sigma_rate) == (0.05, 0.002)
    assert rig.gps.sigma_position == 0.3
    assert rig.lidar.sweep_time == 0.05
