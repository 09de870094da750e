"""On the simulated robot, whose slip, pitch and pixels are nobody's model: small, honest errors."""

from dataclasses import dataclass
from typing import Any

import gymnasium as gym
import numpy as np
import pytest

import grouser  # noqa: F401  (registers the environments)
from grouser.estimators import Status, make
from grouser.estimators.evaluation.consistency import mean_bounds, nees
from grouser.geometry import Array, between
from grouser.rig import Rig

STEPS, SEEDS = 50, (0, 1, 2)


@dataclass(frozen=True)
class Rollout:
    rig: Rig
    observations: list[dict[str, Any]]
    truths: Array
    """(STEPS + 1, 3) in the frame of the start"""


@pytest.fixture(scope="module")
def rollouts() -> list[Rollout]:
    """One for each seed."""
    return [drive(seed=seed, steps=STEPS, speed=0.5) for seed in SEEDS]


def drive(
    *, seed: int, steps: int, speed: float, spinning: bool = False, **options: Any
) -> Rollout:
    """A winding one, or a turn on the spot; speed: a share of the top speed; options: of the
    environment."""
    env = gym.make("grouser/TrackedRobot-v0", sensors=("left", "right", "tracks"), **options)
    shown, info = env.reset(seed=seed)
    observations, poses = [shown], [info["true_pose"]]
    for k in range(steps):
        winding = 0.3 * speed * np.sin(k / 8)
        both = [-speed, speed] if spinning else [speed - winding, speed + winding]
        action = np.clip(both, -1, 1).astype(np.float32)
        shown, _, _, _, info = env.step(action)
        observations.append(shown)
        poses.append(info["true_pose"])
    env.close()
    return Rollout(env.get_wrapper_attr("rig"), observations, between(poses[0], np.array(poses)))


@pytest.mark.parametrize("tracks", [True, False])
@pytest.mark.parametrize("name", ["one-point-ransac", "five-point-ransac"])
def test_errors_are_small_and_as_large_as_said(
    rollouts: list[Rollout], name: str, tracks: bool
) -> None:
    run_nees = []
    for rollout in rollouts:
        unseen = set() if tracks else {"tracks"}
        shown = [{k: o[k] for k in o.keys() - unseen} for o in rollout.observations]
        estimator = make(name, rollout.rig)
        estimator.reset(shown[0], rng=np.random.default_rng(0))
        estimates = [estimator.update(observation) for observation in shown[1:]]
        assert {e.status for e in estimates} == {Status.TRACKING}
        poses, truths = np.array([e.pose for e in estimates]), rollout.truths[1:]
        way = np.linalg.norm(np.diff(rollout.truths[:, :2], axis=0), axis=1).sum()
        error = between(truths[-1], poses[-1])
        assert np.linalg.norm(error[:2]) < 0.01 * way and abs(error[2]) < np.radians(0.3)
        run_nees.append(nees(truths, poses, np.array([e.covariance for e in estimates])).mean())
    # Frames of one run are not independent: three runs are three samples of chi-square(3).
    low, high = mean_bounds(len(SEEDS), confidence=0.998)
    assert low < np.mean(run_nees) < high


def told(rollout: Rollout, offset: float, *, tracks: bool) -> dict[str, float]:
    """The last frame's diagnostics where the rig does not know of an offset [px]."""
    unseen = set() if tracks else {"tracks"}
    shown = [{k: o[k] for k in o.keys() - unseen} for o in rollout.observations]
    rig = rollout.rig.with_overrides({"stereo.disparity_offset": -offset})
    estimator = make("one-point-ransac", rig)
    estimator.reset(shown[0], rng=np.random.default_rng(0))
    return dict([estimator.update(observation) for observation in shown[1:]][-1].diagnostics)


@pytest.mark.parametrize("tracks", [True, False])
def test_a_disparity_offset_is_noticed_and_its_absence_is_not(
    rollouts: list[Rollout], tracks: bool
) -> None:
    """The rig takes its disparities for exact, and from the images alone they are not."""
    for offset, noticed in ((0.0, 0.0), (0.3, 1.0), (-1.5, 1.0)):
        for rollout in rollouts:
            said = told(rollout, offset, tracks=tracks)
            assert said["disparity_suspect"] == noticed
            assert said["disparity_offset_px"] == pytest.approx(offset, rel=0.1, abs=0.1)
            assert said["disparity_offset_sigma_px"] < 0.07


def test_on_the_spot_mistaken_points_are_no_offset_of_all_disparities() -> None:
    """There an offset hardly moves what is seen. What is mistaken looks nearer by one than it is,
    and so surer of it."""
    for seed in (0, 3):
        rollout = drive(
            seed=seed, steps=30, speed=0.4, spinning=True, world="parking-lot", terrain="ice"
        )
        estimator = make("one-point-ransac", rollout.rig)
        estimator.reset(rollout.observations[0], rng=np.random.default_rng(0))
        for observation in rollout.observations[1:]:
            said = estimator.update(observation).diagnostics
            assert said["disparity_suspect"] == 0.0


def test_a_tenth_of_a_pixel_is_noticed_within_four_metres() -> None:
    for seed in (0, 1):
        rollout = drive(seed=seed, steps=80, speed=1.0)
        for offset in (0.0, 0.1):
            said = told(rollout, offset, tracks=True)
            assert said["disparity_suspect"] == float(offset > 0)
            assert said["disparity_offset_px"] == pytest.approx(offset, abs=0.06)


def test_an_eye_that_was_knocked_up_costs_next_to_nothing() -> None:
    """Rows then differ by a pixel, and disparities by a third of one in the corners."""
    knocked = {"stereo.miscalibration": 0.004}
    errors, run_nees = [], []
    for seed in (1, 4, 5):
        rollout = drive(seed=seed, steps=250, speed=0.45, world="orchard", effects=knocked)
        estimator = make("one-point-ransac", rollout.rig)
        estimator.reset(rollout.observations[0], rng=np.random.default_rng(0))
        last = [estimator.update(o) for o in rollout.observations[1:]][-1]
        truth = rollout.truths[-1:]
        errors.append(np.hypot(*between(truth[0], last.pose)[:2]))
        run_nees.append(nees(truth, last.pose[None], last.covariance[None])[0])
    assert np.mean(errors) < 0.006
    assert np.mean(run_nees) < mean_bounds(3, confidence=0.998)[1]


def test_eyes_that_were_knocked_apart_are_found_to_be() -> None:
    """By a yaw, which shifts all disparities, and bends them, which is not taken for a shift."""
    yaw = 0.004
    for seed in (0, 1):
        effects = {"stereo.miscalibration_yaw": yaw}
        rollout = drive(seed=seed, steps=100, speed=0.5, effects=effects)
        said, camera = told(rollout, 0.0, tracks=True), rollout.rig.stereo
        assert camera is not None
        assert said["disparity_suspect"] == 1.0
        assert said["disparity_offset_px"] == pytest.approx(-yaw * camera.fx, abs=0.03)


@pytest.mark.parametrize("tracks", [True, False])
def test_a_robot_that_stands_still_stays_where_it_is(tracks: bool) -> None:
    """Through the noise of its cameras, which at 320 x 240 is twice what it is at 752 x 480."""
    env = gym.make("grouser/TrackedRobot-v0", sensors=("left", "right", "tracks"))
    shown, _ = env.reset(seed=0)
    observations = [shown]
    for _ in range(40):
        observations.append(env.step(np.zeros(2, np.float32))[0])
    assert (observations[5]["left"] != observations[6]["left"]).mean() > 0.3, "pixels are noisy"
    estimator = make("one-point-ransac", env.get_wrapper_attr("rig"), use_tracks=tracks)
    estimator.reset(observations[0], rng=np.random.default_rng(0))
    poses = np.array([estimator.update(observation).pose for observation in observations[1:]])
    env.close()
    assert np.hypot(poses[:, 0], poses[:, 1]).max() < 0.5e-3
    assert np.abs(poses[:, 2]).max() < np.radians(0.03)
