"""One camera and the tracks: words, bad input, a bounded map, and a drive of some metres."""

from typing import Any

import gymnasium as gym
import numpy as np
import pytest

import grouser  # noqa: F401  (registers the environments)
from grouser.estimators import PoseEstimate, Status, make
from grouser.estimators.base import Observation
from grouser.estimators.evaluation.consistency import nees
from grouser.estimators.monocular.estimator import MonocularEkf
from grouser.estimators.synthetic_drive import RIG, synthetic_drive
from grouser.geometry import between
from grouser.rig import Rig

DRIVE = synthetic_drive(frames=24, blackout=range(0))


def run(observations: list[Observation], name: str = "one-point-ekf") -> list[PoseEstimate]:
    estimator = make(name, RIG)
    first = estimator.reset(observations[0], rng=np.random.default_rng(0))
    return [first, *(estimator.update(o) for o in observations[1:])]


def changed(frames: range, **parts: Any) -> list[Observation]:
    """The drive with parts of some observations replaced."""
    return [{**o, **parts} if k in frames else o for k, o in enumerate(DRIVE.observations)]


def test_it_follows_the_robot_and_keeps_a_bounded_map() -> None:
    estimator = MonocularEkf(RIG, points=30)
    estimator.reset(DRIVE.observations[0], rng=np.random.default_rng(0))
    for observation in DRIVE.observations[1:]:
        estimate = estimator.update(observation)
        assert estimate.diagnostics["points"] <= 30
    error = between(DRIVE.poses[-1], estimate.pose)
    assert np.hypot(*error[:2]) < 0.02 and abs(error[2]) < np.radians(0.2)
    landmarks = estimator.map
    assert len(landmarks.positions) >= 10
    # All that can be seen is a wall of the painted room, or its floor, or its ceiling.
    sigma = np.sqrt(np.trace(landmarks.covariances, axis1=1, axis2=2))
    x, y, z = landmarks.positions.T
    off = np.min(np.abs([x - 6.0, x + 3.0, y - 3.5, y + 3.5, z, z - 2.4]), axis=0)
    assert np.mean(off < 3 * sigma + 0.05) > 0.9


@pytest.mark.parametrize("grey", [0, 255])
def test_without_sight_it_coasts_and_comes_back(grey: int) -> None:
    dark = np.full_like(DRIVE.observations[0]["left"], grey)
    estimates = run(changed(range(8, 14), left=dark))
    assert {e.status for e in estimates[8:14]} == {Status.COASTING}
    assert np.trace(estimates[13].covariance) > np.trace(estimates[7].covariance)
    assert {e.status for e in estimates[16:]} == {Status.TRACKING}
    assert np.hypot(*between(DRIVE.poses[-1], estimates[-1].pose)[:2]) < 0.05


def test_a_frozen_image_is_no_sight() -> None:
    estimates = run(changed(range(8, 14), left=DRIVE.observations[7]["left"]))
    assert {e.status for e in estimates[8:14]} == {Status.COASTING}
    assert np.hypot(*between(DRIVE.poses[-1], estimates[-1].pose)[:2]) < 0.05


@pytest.mark.parametrize("told", [np.nan, 0.0])
def test_when_the_tracks_stop_reporting_the_map_keeps_the_scale(told: float) -> None:
    estimates = run(changed(range(10, 16), tracks=np.full(2, told)))
    assert estimates[-1].status is Status.TRACKING
    error = between(DRIVE.poses[-1], estimates[-1].pose)
    assert np.hypot(*error[:2]) < 0.1 and abs(error[2]) < np.radians(1)
    assert np.isfinite(np.array([e.covariance for e in estimates])).all()


@pytest.mark.parametrize("name", ["one-point-ekf", "two-point-ekf"])
def test_the_same_seed_gives_the_same_bits(name: str) -> None:
    first, second = (run(list(DRIVE.observations), name) for _ in range(2))
    for a, b in zip(first, second, strict=True):
        np.testing.assert_array_equal(a.pose, b.pose)
        np.testing.assert_array_equal(a.covariance, b.covariance)


def test_its_words() -> None:
    with pytest.raises(ValueError, match="one camera alone cannot tell how far it went"):
        MonocularEkf(Rig(dt=0.1, stereo=RIG.stereo))
    with pytest.raises(ValueError, match="needs rig.stereo for its camera"):
        MonocularEkf(Rig(dt=0.1, tracks=RIG.tracks))
    with pytest.raises(ValueError, match="sample must be 1 or 2 matches a hypothesis, got 3"):
        MonocularEkf(RIG, sample=3)
    with pytest.raises(ValueError, match="points must be a whole number of at least 8, got 4"):
        MonocularEkf(RIG, points=4)
    with pytest.raises(ValueError, match="threshold_px must be positive and finite, got 0"):
        MonocularEkf(RIG, threshold_px=0)
    estimator = MonocularEkf(RIG)
    with pytest.raises(RuntimeError, match="before asking for the map"):
        _ = estimator.map
    with pytest.raises(RuntimeError, match="call reset"):
        estimator.update(DRIVE.observations[0])
    estimator.reset(DRIVE.observations[0], rng=np.random.default_rng(0))
    with pytest.raises(ValueError, match="calibrated for 320 x 240"):
        estimator.update({**DRIVE.observations[1], "left": np.zeros((5, 5, 1), np.uint8)})
    with pytest.raises(ValueError, match="'tracks' must be two numbers"):
        estimator.update({**DRIVE.observations[1], "tracks": np.zeros(3)})


def test_on_the_simulated_yard_it_errs_little_and_says_so() -> None:
    env = gym.make("grouser/TrackedRobot-v0", sensors=("left", "tracks"))
    errors, squares = [], []
    for seed in range(2):
        shown, info = env.reset(seed=seed)
        estimator = make("one-point-ekf", env.get_wrapper_attr("rig"))
        estimator.reset(shown, rng=np.random.default_rng(0))
        start, way, last, sigma = info["true_pose"], 0.0, info["true_pose"], 0.0
        truths, estimates = [], []
        for k in range(80):
            winding = 0.2 * np.sin(k / 10)
            shown, _, _, _, info = env.step(np.array([0.6 - winding, 0.6 + winding], np.float32))
            way += float(np.hypot(*(info["true_pose"] - last)[:2]))
            last = info["true_pose"]
            estimates.append(estimator.update(shown))
            truths.append(between(start, last))
        poses = np.array([e.pose for e in estimates])
        error = between(truths[-1], poses[-1])
        sigma = float(np.sqrt(np.trace(estimates[-1].covariance[:2, :2])))
        assert np.hypot(*error[:2]) < 0.02 * way and np.hypot(*error[:2]) < 4 * sigma
        errors.append(error)
        covariances = np.array([e.covariance for e in estimates])
        squares.append(nees(np.array(truths), poses, covariances).mean())
    env.close()
    assert np.mean(np.abs(errors), axis=0)[2] < np.radians(0.3)
    assert np.mean(squares) < 8
