"""Motions and generators for tests of single sensors."""

import numpy as np
from scipy.spatial.transform import Rotation

from grouser.envs.sensors.base import Sensor
from grouser.envs.simulation.motion import Motion
from grouser.envs.simulation.tracks import GRAVITY
from grouser.envs.tracked_robot import SENSORS, TrackedRobotEnv
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


def sensor_of(env: TrackedRobotEnv, key: str) -> Sensor:
    """The sensor of an environment that gives a key."""
    return next(sensor for sensor in env._sensors if key in sensor.spaces)
