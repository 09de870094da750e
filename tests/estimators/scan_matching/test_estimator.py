"""Scan matching as an estimator: it follows, as sure as it may be, and in a corridor not at all."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from grouser.estimators import PoseEstimate, Status, make
from grouser.estimators.scan_matching.local_map import LocalMapOptions
from grouser.geometry import Array, between, compose, exp, log, wrap
from grouser.rig import Lidar, Rig
from grouser.rig_motion import Odometry
from tests.estimators.line_slam.walls import lidar, mounted, polygon, seen

HALL = np.concatenate(
    [
        polygon([[-5, -4], [9, -4], [9, 5], [-5, 5]]),
        polygon([[-0.5, 1.6], [0.7, 1.6], [0.7, 3.0], [-0.5, 3.0]]),
        polygon([[4.0, -2.5], [4.6, -2.5], [4.6, -1.7], [4.0, -1.7]]),
    ]
)
CORRIDOR = np.array([[[-100.0, -1.0], [100.0, -1.0]], [[-100.0, 1.2], [100.0, 1.2]]])
ODOMETRY = Odometry(0.005, 0.02, 0.005, 0.01, 0.02)
ARC = exp([0.06, 0.0, 0.025])
DT = 0.1


def drive(
    walls: Array, sensor: Lidar, steps: int, seed: int, *, step: Array = ARC, told: bool = True
) -> tuple[Rig, list[dict[str, Any]], Array]:
    """A rig, observations of a robot that repeats a step, and its poses (n, 3)."""
    rng = np.random.default_rng(seed)
    rig = Rig(dt=DT, lidar=sensor, odometry=ODOMETRY if told else None)
    poses, observations = np.zeros((steps + 1, 3)), []
    o = ODOMETRY
    sigma = np.array([o.position + o.position_per_metre * 0.06] * 2 + [o.heading + 0.0011])
    for k in range(steps + 1):
        if k:
            poses[k] = compose(poses[k - 1], step)
        during = np.linspace(-sensor.sweep_time / DT, 0.0, sensor.n_beams)[:, None] * log(step)
        sent = compose(poses[k], exp(during if k else 0 * during))
        observation = {
            "lidar": seen(walls, sensor, sent, rng).astype(np.float32),
            "stamp": np.array([k * DT]),
        }
        if told:
            observation["odometry"] = np.zeros(3) if k == 0 else step + sigma * rng.normal(size=3)
        observations.append(observation)
    return rig, observations, poses


def estimates(rig: Rig, observations: list[dict[str, Any]], **options: Any) -> list[PoseEstimate]:
    estimator = make("scan-matching", rig, **options)
    told = [estimator.reset(observations[0], rng=np.random.default_rng(0))]
    return told + [estimator.update(observation) for observation in observations[1:]]


def errors(told: list[PoseEstimate], poses: Array) -> Array:
    off = np.array([estimate.pose for estimate in told]) - poses
    off[:, 2] = wrap(off[:, 2])
    return off


@pytest.mark.parametrize("odometry", [True, False])
def test_it_follows_a_robot_with_odometry_or_without(odometry: bool) -> None:
    rig, observations, poses = drive(HALL, lidar(), 80, 0, told=odometry)
    told = estimates(rig, observations)
    off = errors(told, poses)
    assert np.abs(off[:, :2]).max() < 0.03 and np.abs(off[:, 2]).max() < 0.01
    assert all(estimate.status is Status.TRACKING for estimate in told[1:])
    assert told[-1].diagnostics["inlier_ratio"] > 0.9


def test_without_noise_the_way_is_exact() -> None:
    sensor = lidar(sigma_range=0.0, sigma_bearing=0.0, mount=mounted(0.2, 0.0))
    rig, observations, poses = drive(HALL, sensor, 60, 1)
    assert np.abs(errors(estimates(rig, observations), poses)).max() < 2e-3


def test_its_covariance_is_honest() -> None:
    nees = []
    for seed in range(4):
        rig, observations, poses = drive(HALL, lidar(180, sigma_range=0.02), 60, seed)
        told = estimates(rig, observations)
        for off, estimate in zip(errors(told, poses)[10:], told[10:], strict=True):
            nees.append(off @ np.linalg.solve(estimate.covariance, off))
    assert 1.5 < np.mean(nees) < 4.5


def test_along_a_corridor_it_goes_as_far_as_the_odometry_and_says_so() -> None:
    straight, nees = np.array([0.06, 0.0, 0.0]), []
    for seed in range(6):
        rig, observations, poses = drive(CORRIDOR, lidar(range_max=10.0), 60, seed, step=straight)
        told, along = estimates(rig, observations), 0.0
        for observation in observations:
            along += observation["odometry"][0]
        last, off = told[-1], errors(told, poses)[-1]
        assert abs(last.pose[0] - along) < 0.05
        white = (ODOMETRY.position + ODOMETRY.position_per_metre * 0.06) * np.sqrt(60)
        assert np.sqrt(last.covariance[0, 0]) > 0.9 * white
        assert np.sqrt(last.covariance[1, 1]) < 0.02
        nees.append(off @ np.linalg.solve(last.covariance, off))
    assert np.mean(nees) < 7.4  # chi-square of 18 at 99.9 %, over 6


def test_a_blackout_is_bridged_by_the_odometry() -> None:
    rig, observations, poses = drive(HALL, lidar(), 60, 2)
    for k in range(30, 45):
        observations[k]["lidar"] = np.full(360, 30.0, dtype=np.float32)
    told = estimates(rig, observations)
    assert told[44].status is Status.COASTING and told[45].status is Status.TRACKING
    assert told[44].covariance[0, 0] > 4 * told[29].covariance[0, 0]
    assert np.abs(errors(told, poses)[-1]).max() < 0.05


def test_a_scan_that_is_shown_again_tells_nothing_new() -> None:
    rig, observations, _ = drive(HALL, lidar(), 12, 3)
    stale = dict(observations[9]) | {"stamp": np.array([1.0])}
    for observation in observations:
        observation["lidar_stamp"] = observation["stamp"]
    stale |= {"lidar_stamp": observations[9]["stamp"], "odometry": np.array([0.06, 0.0, 0.025])}
    told = estimates(rig, [*observations[:10], stale])
    moved = between(told[9].pose, told[10].pose)
    np.testing.assert_allclose(moved, stale["odometry"], atol=2e-3)
    assert "score" not in told[10].diagnostics


def test_the_map_is_as_long_as_its_options_say() -> None:
    rig, observations, _ = drive(HALL, lidar(), 60, 4)
    told = estimates(rig, observations, local_map=LocalMapOptions(scans=3, step=0.2))
    assert told[-1].diagnostics["scans_in_map"] == 3.0
    told = estimates(rig, observations, local_map=LocalMapOptions(length=1.0, step=0.2))
    assert 4.0 <= told[-1].diagnostics["scans_in_map"] <= 6.0


def test_what_it_cannot_do_is_refused() -> None:
    with pytest.raises(ValueError, match=r"scan matching needs rig.lidar, and this rig has None"):
        make("scan-matching", Rig(dt=0.1))
    rig = Rig(dt=0.1, lidar=lidar())
    with pytest.raises(ValueError, match=r'odometry="none"|needs rig.tracks'):
        make("scan-matching", rig, odometry="tracks")
    with pytest.raises(ValueError, match="LocalMapOptions.scans must be a positive whole number"):
        LocalMapOptions(scans=0)
    with pytest.raises(RuntimeError, match=r"call reset\(\) with the first observation"):
        make("scan-matching", rig).update({})


def test_a_scan_that_takes_time_is_straightened_by_the_motion() -> None:
    quick = exp([0.08, 0.0, 0.12])
    rig, observations, poses = drive(HALL, replace(lidar(), sweep_time=0.1), 30, 5, step=quick)
    off = np.abs(errors(estimates(rig, observations), poses)).max(axis=0)
    still = replace(rig, lidar=lidar())
    skewed = np.abs(errors(estimates(still, observations), poses)).max(axis=0)
    # What is left is that the odometry which straightens a scan errs by 6 mrad a step.
    assert off[:2].max() < 0.02 and off[2] < 0.012
    assert skewed[2] > 3 * off[2]
