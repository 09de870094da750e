"""In the dark on uneven ground: the heading is about the vertical, as ever the robot leans."""

import math

import numpy as np
import pytest

from grouser.estimators import make
from grouser.estimators.gyro import GyroOptions
from grouser.estimators.inclination import GRAVITY
from grouser.geometry import Array, rotation_from_rpy, so3_exp, wrap
from grouser.rig import Imu, Rig, StereoCamera, TrackGeometry, camera_mount

DT, STEPS = 0.1, 200
TRACKS = TrackGeometry(gauge=0.4, width=0.08, effective_width=0.6)
IMU = Imu(sigma_acceleration=0.05, sigma_rate=0.002)
STEREO = StereoCamera(
    50.0, 50.0, 31.5, 23.5, 0.12, 64, 48, T_base_camera=camera_mount(0.2, 0.0, 0.3)
)
BLACK = np.zeros((48, 64, 1), np.uint8)


def heading(R: Array) -> float:
    return math.atan2(R[1, 0], R[0, 0])


def shown(step: int, R: Array, rate: Array, rng: np.random.Generator) -> dict[str, Array]:
    """On the spot, at a rate (3,) [rad/s]."""
    imu = np.append(R.T @ [0.0, 0.0, GRAVITY], rate)
    imu += np.repeat([IMU.sigma_acceleration, IMU.sigma_rate], 3) * rng.normal(size=6)
    du = np.array([-0.5, 0.5]) * TRACKS.effective_width * rate[2] * DT
    seen = {"left": BLACK, "right": BLACK, "tracks": du, "imu": imu}
    return seen | {"stamp": np.array([DT * step])}


def rocking(rng: np.random.Generator) -> tuple[list[dict[str, Array]], float, float]:
    """A robot that turns and rocks on a slope: what it is shown, how far its heading turned and how
    far it turned about its own z axis, rad, not wrapped."""
    R = rotation_from_rpy(0.2, -0.2, 0.0)
    turned, about_z = 0.0, 0.0
    observations = [shown(0, R, np.zeros(3), rng)]
    for step in range(1, STEPS + 1):
        rate = np.array([0.4 * math.sin(0.3 * step), 0.4 * math.cos(0.3 * step), 0.3])
        before, R = R, R @ so3_exp(rate * DT)
        observations.append(shown(step, R, rate, rng))
        turned += math.remainder(heading(R) - heading(before), math.tau)
        about_z += rate[2] * DT
    return observations, turned, about_z


@pytest.mark.parametrize("use_tracks", [True, False])
def test_the_heading_turns_about_the_vertical(use_tracks: bool) -> None:
    off, squares = [], []
    for seed in range(4):
        rng = np.random.default_rng(seed)
        observations, turned, about_z = rocking(rng)
        assert abs(turned - about_z) > np.radians(20)
        rig = Rig(dt=DT, stereo=STEREO, tracks=TRACKS, imu=IMU)
        estimator = make("vo-imu-gps", rig, use_tracks=use_tracks, gyro=GyroOptions(bias_sigma=0))
        estimator.reset(observations[0], rng=rng)
        for observation in observations[1:]:
            last = estimator.update(observation)
        error = float(wrap(last.pose[2] - turned))
        off.append(error)
        squares.append(error**2 / last.covariance[2, 2])
    assert np.abs(off).max() < np.radians(1.5)
    assert np.mean(squares) < 3.3
