"""Visual odometry with imu and fixes: what each of them adds, and what none of them may spoil."""

from collections.abc import Mapping
from functools import cache
from typing import Any

import gymnasium as gym
import numpy as np
import pytest

import grouser  # noqa: F401  (registers the environments)
from grouser.estimators import PoseEstimate, Status, make
from grouser.estimators.conformance import check_pose_estimator
from grouser.estimators.evaluation.consistency import nees
from grouser.geometry import Array, between, wrap
from grouser.rig import Rig

STEPS, SEEDS = 100, (0, 1, 2)
BIAS = 0.006
"""rad/s, of the gyroscope"""

Seen = Mapping[str, Any]


@cache
def driven(seed: int, bias: float = 0.0) -> tuple[Rig, list[Seen], Array]:
    """Curves and back on grass; the poses (STEPS + 1, 3) from the start."""
    env = gym.make(
        "grouser/TrackedRobot-v0",
        terrain="grass",
        sensors=("left", "right", "tracks", "imu", "gps"),
        dynamics="fast",
        effects={"imu.rate_bias": bias},
    )
    seen, info = env.reset(seed=seed)
    observations, poses = [seen], [info["true_pose"]]
    for step in range(STEPS):
        action = ([0.5, 0.9], [0.9, 0.6], [-0.6, -0.9])[step // 20 % 3]
        seen, _, _, _, info = env.step(np.array(action, np.float32))
        observations.append(seen)
        poses.append(info["true_pose"])
    rig = env.get_wrapper_attr("rig")
    env.close()
    return rig, observations, between(poses[0], np.array(poses))


def run(rig: Rig, observations: list[Seen], name: str, **options: Any) -> list[PoseEstimate]:
    estimator = make(name, rig, **options)
    first = estimator.reset(observations[0], rng=np.random.default_rng(0))
    return [first, *(estimator.update(o) for o in observations[1:])]


def without(observations: list[Seen], *keys: str) -> list[Seen]:
    return [{k: v for k, v in o.items() if k not in keys} for o in observations]


def dark_from(observations: list[Seen], start: int, end: int | None = None) -> list[Seen]:
    black = np.zeros_like(observations[0]["left"])
    blind = {"left": black, "right": black}
    dark = range(len(observations))[start:end]
    return [{**o, **blind} if k in dark else o for k, o in enumerate(observations)]


def errors(estimates: list[PoseEstimate], truths: Array) -> Array:
    """(n, 3) in the frame of the start."""
    found = np.array([e.pose for e in estimates]) - truths
    found[:, 2] = wrap(found[:, 2])
    return found


def test_the_gyroscopes_bias_is_observed() -> None:
    rig, observations, _ = driven(0, BIAS)
    told = run(rig, observations, "vo-imu-gps", use_gps=False)[-1].diagnostics
    assert told["gyro_bias_sigma"] < 0.001
    assert abs(told["gyro_bias"] - BIAS) < 4 * told["gyro_bias_sigma"]


@pytest.mark.parametrize("unseen", [(), ("tracks",)])
def test_it_is_honest_and_as_good_as_vision(unseen: tuple[str, ...]) -> None:
    run_nees, ends = [], []
    for seed in SEEDS:
        rig, observations, truths = driven(seed)
        estimates = run(rig, without(observations, "gps", *unseen), "vo-imu-gps")
        assert {e.status for e in estimates} == {Status.TRACKING}
        poses = np.array([e.pose for e in estimates])
        P = np.array([e.covariance for e in estimates])
        run_nees.append(nees(truths[1:], poses[1:], P[1:]).mean())
        ends.append(np.hypot(*errors(estimates, truths)[-1, :2]))
    assert 0.4 < np.mean(run_nees) < 6.5  # three samples of chi-square(3)
    assert np.mean(ends) < 0.012


@pytest.mark.parametrize("unseen", [(), ("tracks",)])
def test_in_the_dark_the_gyroscope_holds_the_heading(unseen: tuple[str, ...]) -> None:
    with_imu, without_imu = [], []
    for seed in SEEDS[:2]:
        rig, observations, truths = driven(seed, BIAS)
        dark = dark_from(without(observations, "gps", *unseen), 60)
        estimates = run(rig, dark, "vo-imu-gps", lost_after=9.0)
        assert estimates[-1].status is Status.COASTING
        error = errors(estimates, truths)[-1]
        with_imu.append(abs(error[2]))
        assert error @ np.linalg.solve(estimates[-1].covariance, error) < 16.3  # chi2_3(0.999)
        blind = run(rig, dark, "one-point-ransac")
        without_imu.append(abs(errors(blind, truths)[-1, 2]))
    assert np.mean(with_imu) < np.radians(0.4)
    assert np.mean(with_imu) < np.mean(without_imu) / 2


def test_fixes_bound_the_drift_of_a_long_drive_in_the_dark() -> None:
    env = gym.make(
        "grouser/TrackedRobot-v0", terrain="grass", sensors=("tracks", "imu", "gps"),
        dynamics="fast", timing={"gps.rate": 1.0, "gps.latency": 0.2},
    )  # fmt: skip
    seen, info = env.reset(seed=0)
    rig, start = env.get_wrapper_attr("rig"), info["true_pose"]
    camera = rig.stereo
    assert camera is not None
    black = np.zeros((camera.height, camera.width, 1), np.uint8)
    dark = {"left": black, "right": black}
    fixed, free = (make("vo-imu-gps", rig, use_gps=use) for use in (True, False))
    sigmas, far = [], []
    for estimator in (fixed, free):
        estimator.reset({**seen, **dark}, rng=np.random.default_rng(0))
    for step in range(600):
        action = [0.7, 0.9] if (step // 75) % 2 == 0 else [-0.7, -0.9]
        seen, _, _, _, info = env.step(np.array(action, np.float32))
        estimates = [estimator.update({**seen, **dark}) for estimator in (fixed, free)]
        truth = between(start, info["true_pose"])
        found = [errors([e], truth[None])[0] for e in estimates]
        sigmas.append([np.sqrt(np.trace(e.covariance[:2, :2])) for e in estimates])
        far.append([error @ np.linalg.solve(e.covariance, error) for error, e in
                    zip(found, estimates, strict=True)])  # fmt: skip
    env.close()
    assert {e.status for e in estimates[:1]} == {Status.TRACKING}
    assert max(s[0] for s in sigmas[100:]) < 0.5 < sigmas[-1][1]
    assert np.mean([f[0] for f in far[50:]]) < 7.8  # chi2_3(0.95): one drive
    assert np.hypot(*found[0][:2]) < 0.6


def test_an_outlier_among_the_fixes_is_rejected_and_said() -> None:
    rig, observations, truths = driven(0)
    spoilt: list[Seen] = list(observations)
    for k in range(50, 55):
        spoilt[k] = {**spoilt[k], "gps": spoilt[k]["gps"] + [30.0, -20.0]}
    estimates = run(rig, spoilt, "vo-imu-gps")
    rejected = [k for k, e in enumerate(estimates) if e.diagnostics["fix_rejected"]]
    assert set(range(50, 55)) <= set(rejected)
    assert len(rejected) <= 7  # one in a thousand of the good ones
    assert np.abs(errors(estimates, truths)[50:, :2]).max() < 0.05


def test_without_fixes_it_is_as_without_a_receiver() -> None:
    rig, observations, _ = driven(0)
    nowhere: list[Seen] = [{**o, "gps": np.full(2, np.nan)} for o in observations[:30]]
    none = run(rig, nowhere, "vo-imu-gps")[-1]
    never = run(rig, without(observations[:30], "gps"), "vo-imu-gps")[-1]
    assert np.array_equal(none.pose, never.pose)
    assert np.array_equal(none.covariance, never.covariance)


def test_the_covariance_goes_on_smoothly_into_the_dark_and_back() -> None:
    rig, observations, _ = driven(1)
    dark = dark_from(without(observations, "gps"), 40, 60)
    estimates = run(rig, dark, "vo-imu-gps")
    sigma = np.array([np.sqrt(np.diag(e.covariance)) for e in estimates])
    status = [e.status for e in estimates]
    assert status[39] is status[-1] is Status.TRACKING and status[50] is Status.COASTING
    assert (np.diff(sigma[40:60, 2]) > -1e-9).all()  # in the dark the heading's only grows
    assert np.diff(sigma[:, 2]).max() < np.radians(0.05)
    assert np.diff(sigma[:, :2], axis=0).max() < 0.007


def test_a_dark_frame_is_no_reason_to_forget_what_was_seen_before() -> None:
    """Without tracks the way since vision's anchor is known from vision alone."""
    rig, observations, truths = driven(1)
    dark = dark_from(without(observations, "gps", "tracks"), 47, 48)
    error = errors(run(rig, dark, "vo-imu-gps"), truths)
    assert np.hypot(*(error[47] - error[46])[:2]) < 0.02


def test_without_tracks_vision_or_fixes_it_is_lost_and_light_brings_it_back() -> None:
    rig, observations, _ = driven(2)
    dark = dark_from(without(observations, "gps", "tracks"), 20, 40)
    status = [e.status for e in run(rig, dark, "vo-imu-gps")]
    assert status[25] is Status.COASTING and status[38] is Status.LOST
    assert status[-1] is Status.TRACKING


def test_it_keeps_the_contract_without_tracks() -> None:
    check_pose_estimator("vo-imu-gps", use_tracks=False)


def test_a_rig_without_an_imu_is_refused_with_the_remedy() -> None:
    rig = driven(0)[0].with_overrides({"imu": None})
    with pytest.raises(ValueError, match=r"vo-imu-gps needs rig\.imu, .*choose 'one-point-ransac'"):
        make("vo-imu-gps", rig)
