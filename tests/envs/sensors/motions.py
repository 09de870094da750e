"""Motions and generators for tests of single sensors."""

from collections.abc import Iterable, Mapping, Sequence

import numpy as np
from scipy.spatial.transform import Rotation

from grouser.envs.sensors.base import Reading, Sensor
from grouser.envs.sensors.schedule import Schedule
from grouser.envs.sensors.suite import SENSORS
from grouser.envs.simulation.motion import Motion
from grouser.envs.simulation.robot import RobotModel, TrackedRobot
from grouser.envs.simulation.tracks import GRAVITY
from grouser.envs.simulation.world import World
from grouser.geometry import Array


def at_rest(T_world_base: Array, track_travel: tuple[float, float] = (0.0, 0.0)) -> Motion:
    """A robot that rests at a pose, whatever its tracks do."""
    return Motion(
        T_world_base=T_world_base,
        twist=np.zeros(3),
        track_speed=np.array(track_travel) / 0.1,
        track_travel=np.array(track_travel),
        specific_force=np.array([0.0, 0.0, GRAVITY]),
        angular_rate=np.zeros(3),
        contacts=0,
        collision=False,
        path=np.tile(path_point(T_world_base), (25, 1)),
    )


def path_point(T_world_base: Array) -> Array:
    """(7,) position and quaternion of a pose."""
    quaternion = Rotation.from_matrix(T_world_base[:3, :3]).as_quat()
    return np.concatenate([T_world_base[:3, 3], quaternion])


def generators(seed: int) -> dict[str, np.random.Generator]:
    """One generator for each key of the observation."""
    return dict(zip(SENSORS, np.random.default_rng(seed).spawn(len(SENSORS)), strict=True))


QUIET = {
    "stereo.read_noise": 0.0,
    "lidar.range_noise": 0.0,
    "lidar.bearing_noise": 0.0,
    "tracks.noise": 0.0,
    "imu.acceleration_noise": 0.0,
    "imu.rate_noise": 0.0,
    "gps.noise": 0.0,
}
"""No noise at all."""


def quiet(effects: Mapping[str, float] | None = None) -> Mapping[str, float]:
    """The amounts of all effects where there are but these."""
    return Schedule(QUIET | dict(effects or {})).steady


def readings(
    sensor: Sensor,
    world: World,
    motions: Iterable[Motion],
    amounts: Mapping[str, float],
    *,
    seed: int = 0,
) -> list[Reading]:
    """What a sensor reads after each motion of an episode."""
    sensor.enter(world, generators(seed))
    read = []
    for motion in motions:
        sensor.advance(motion)
        read.append(sensor.read(motion, amounts))
    return read


def drive(world: World, speeds: Sequence[tuple[float, float]]) -> list[Motion]:
    """Standing at the start of a world, then a control step of 0.1 s with each pair of speeds."""
    robot = TrackedRobot(RobotModel(), dt=0.1, dynamics="fast")
    return [robot.enter(world), *(robot.step(np.array(pair)) for pair in speeds)]
