"""The rig of the simulated robot, and how its effective width was measured."""

import math
from collections.abc import Mapping

import numpy as np

from grouser.envs.simulation.motion import STRAIGHT_RATE
from grouser.envs.simulation.renderers.pinhole import Pinhole
from grouser.envs.simulation.robot import RobotModel, TrackedRobot
from grouser.envs.simulation.world import World
from grouser.geometry import transform
from grouser.rig import Gps, Imu, Lidar, Rig, StereoCamera, TrackGeometry, camera_mount

EFFECTIVE_WIDTH = 0.588
"""Of the robot on gravel, m: `measure_effective_width`, rounded."""

_CALIBRATION = (-1.0, 0.4, 0.8)
"""Speeds of the slower track over that of the faster one."""

_BASELINE = 0.12
_FIELD_OF_VIEW = math.radians(66)
_N_BEAMS = 360


def robot_rig(
    model: RobotModel,
    *,
    dt: float,
    image_size: tuple[int, int],
    amounts: Mapping[str, float],
) -> Rig:
    """The robot's calibration, which is exact but for the noise that it states.

    The stereo pair looks 10 degrees down from 0.40 m above the ground, on either side of the
    robot's centre line; the lidar turns above it, so that the robot does not see itself.

    Args:
        dt: time between two observations, s.
        image_size: width and height, px.
        amounts: of the effects that the rig states, by name: the noises of lidar, imu and gps,
            and how long a scan takes.
    """
    pinhole = Pinhole.with_field_of_view(*image_size, _FIELD_OF_VIEW)
    tracks = TrackGeometry(
        gauge=model.tracks.gauge, width=model.tracks.width, effective_width=EFFECTIVE_WIDTH
    )
    stereo = StereoCamera(
        fx=pinhole.fx,
        fy=pinhole.fy,
        cx=pinhole.cx,
        cy=pinhole.cy,
        baseline=_BASELINE,
        width=pinhole.width,
        height=pinhole.height,
        T_base_camera=camera_mount(0.20, _BASELINE / 2, 0.40, pitch=math.radians(10)),
    )
    lidar = Lidar(
        n_beams=_N_BEAMS,
        angle_min=-math.pi,
        angle_increment=2 * math.pi / _N_BEAMS,
        range_min=0.05,
        range_max=12.0,
        sigma_range=amounts["lidar.range_noise"],
        sigma_bearing=amounts["lidar.bearing_noise"],
        T_base_lidar=transform(np.eye(3), [0.0, 0.0, 0.45]),
        sweep_time=amounts["lidar.motion_skew"],
    )
    imu = Imu(
        sigma_acceleration=amounts["imu.acceleration_noise"], sigma_rate=amounts["imu.rate_noise"]
    )
    gps = Gps(sigma_position=amounts["gps.noise"])
    return Rig(dt=dt, tracks=tracks, stereo=stereo, lidar=lidar, imu=imu, gps=gps)


def measure_effective_width(
    model: RobotModel, world: World, *, speed: float = 0.5, dynamics: str = "fast"
) -> float:
    """Mean of (u_R - u_L) / yaw rate over spot turns, tight and wide curves to either side, m.

    This is the calibration that a user does: drive the courses that the robot will drive, and
    compare the tracks' increments with the angle turned. Motion resistance makes a spot turn wider
    than a curve.

    Args:
        speed: of the faster track, m/s.
        dynamics: as `TrackedRobot` has them.

    Raises:
        RuntimeError: the robot does not turn.
    """
    robot = TrackedRobot(model, dt=0.1, dynamics=dynamics)
    try:
        widths = [
            effective_width(robot, world, command)
            for slower in _CALIBRATION
            for command in ((slower * speed, speed), (speed, slower * speed))
        ]
    finally:
        robot.close()
    return float(np.mean(widths))


def effective_width(robot: TrackedRobot, world: World, command: tuple[float, float]) -> float:
    """(u_R - u_L) / yaw rate in a steady turn from the start of a world, m.

    Args:
        command: speed of the left and right track, m/s.

    Raises:
        RuntimeError: the robot does not turn.
    """
    robot.enter(world)
    steps = [robot.step(command) for _ in range(30)][10:]  # the first second gets it going
    rate = float(np.mean([motion.twist[2] for motion in steps]))
    if abs(rate) < STRAIGHT_RATE:
        raise RuntimeError(f"the robot did not turn with its tracks at {command} m/s")
    return float(np.mean([np.diff(motion.track_speed)[0] for motion in steps])) / rate
