"""On a hillside that an imu feels: as honest as its model of creep and slip says."""

import numpy as np

from grouser import geometry
from grouser.estimators.gyro import GyroOptions
from grouser.estimators.icr_ekf import IcrEkf
from grouser.estimators.icr_motion import icr_pose
from grouser.estimators.icr_predictor import IcrOptions
from grouser.estimators.inclination import GRAVITY
from grouser.estimators.slope import SlopeOptions, slip_covariance
from grouser.geometry import Array, rotation_from_rpy
from grouser.rig import Imu, Rig, TrackGeometry

DT, WIDTH = 0.1, 0.6
IMU = Imu(sigma_acceleration=0.05, sigma_rate=0.002)
RIG = Rig(dt=DT, tracks=TrackGeometry(gauge=0.4, width=0.08, effective_width=WIDTH), imu=IMU)
CENTRES = np.array([WIDTH / 2, -WIDTH / 2, 0.0])
CURVES = np.repeat([(0.03, 0.05), (0.04, 0.04), (0.05, 0.02), (-0.02, 0.03)], 30, axis=0)
KNOWN = IcrOptions(
    centre_sigma=1e-6,
    ahead_sigma=0.0,
    centre_walk=0.0,
    scale_sigma=0.0,
    side_sigma=0.0,
    spot_sigma=0.0,
    track_noise=0.0,
    track_noise_floor=1e-5,
    transient_noise=0.0,
    turn_noise=0.0,
    side_slip=0.0,
    side_slip_turning=0.0,
)
SLOPE = SlopeOptions(turn_slip=0.1)
"""The slip of one step that is as large as what stands for a metre of it would count as a spin."""
NO_SLOPE = SlopeOptions(
    **dict.fromkeys(("creep_turning", "creep_turning_sigma", "creep_turning_walk"), 0.0),
    **dict.fromkeys(("creep_along", "creep_along_sigma", "creep_along_walk"), 0.0),
    **dict.fromkeys(("turn_slip", "slide", "turn_bump", "slide_bump"), 0.0),
)


def heading(R: Array) -> float:
    return float(np.arctan2(R[1, 0], R[0, 0]))


def hillside(rng: np.random.Generator) -> tuple[list[dict[str, Array]], Array]:
    """Observations of a drive on a plane that falls by 15 degrees, and where it ended: (3,)."""
    options = SLOPE
    R = rotation_from_rpy(0.0, np.radians(15.0), 0.0) @ rotation_from_rpy(
        0.0, 0.0, rng.uniform(-np.pi, np.pi)
    )
    creep = np.array([options.creep_turning * WIDTH, options.creep_along])
    creep += rng.normal(size=2) * [options.creep_turning_sigma * WIDTH, options.creep_along_sigma]
    bias = GyroOptions().bias_sigma * rng.normal(size=3)
    downhill, start = np.array([np.sin(np.radians(15.0)), 0.0]), heading(R)
    observations = [_seen(rng, R, np.zeros(2), bias, 0)]
    at = np.zeros(2)
    for step, du in enumerate(CURVES, start=1):
        x, y, turn = icr_pose(du, CENTRES)
        slip = slip_covariance(turn, float(downhill @ downhill), 0.0, WIDTH, options)
        slid = np.sqrt(np.diag(slip)) * rng.normal(size=3)
        at = at + R[:2, 0] * x + R[:2, 1] * y + slid[:2]
        at = at + downhill * (creep[0] * abs(turn) + creep[1] * abs(x))
        R = R @ rotation_from_rpy(0.0, 0.0, turn + slid[2])
        rates = bias + [0.0, 0.0, (turn + slid[2]) / DT]
        observations.append(_seen(rng, R, du, rates, step))
    end = geometry.rotate(-start, at)
    return observations, np.append(end, geometry.wrap(heading(R) - start))


def _seen(
    rng: np.random.Generator, R: Array, du: Array, rates: Array, step: int
) -> dict[str, Array]:
    force = R.T @ [0.0, 0.0, GRAVITY] + IMU.sigma_acceleration * rng.normal(size=3)
    rates = rates + IMU.sigma_rate * rng.normal(size=3)
    return {"tracks": du, "imu": np.append(force, rates), "stamp": np.array([DT * step])}


def ratio(observations: list[dict[str, Array]], end: Array, slope: SlopeOptions) -> float:
    """NEES at the end."""
    estimator = IcrEkf(RIG, icr=KNOWN, slope=slope)
    estimator.reset(observations[0], rng=np.random.default_rng(0))
    for observation in observations[1:]:
        last = estimator.update(observation)
    error = last.pose - end
    error[2] = geometry.wrap(error[2])
    return float(error @ np.linalg.solve(last.covariance, error))


def test_it_is_honest_on_its_own_model_of_a_slope() -> None:
    rng, runs = np.random.default_rng(0), 60
    drives = [hillside(rng) for _ in range(runs)]
    found = np.array([ratio(*drive, SLOPE) for drive in drives])
    assert abs(found.mean() - 3) < 3.3 * np.sqrt(6 / runs) + 0.3  # and what is not linear
    assert np.mean([ratio(*drive, NO_SLOPE) for drive in drives[:10]]) > 10
