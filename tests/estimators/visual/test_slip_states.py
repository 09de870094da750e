"""Visual odometry that estimates centres of rotation, or the tracks' scales alone."""

from functools import cache
from typing import Any

import gymnasium as gym
import numpy as np
import pytest

import grouser  # noqa: F401  (registers the environments)
from grouser.estimators import PoseEstimate, make
from grouser.estimators.conformance import check_pose_estimator
from grouser.estimators.evaluation.consistency import nees
from grouser.estimators.icr_predictor import IcrOptions
from grouser.estimators.visual.prediction import ScaleOptions
from grouser.geometry import Array, between
from grouser.rig import Rig

STEPS, SEEDS = 100, (0, 1, 2)


@cache
def driven(terrain: str, seed: int) -> tuple[Rig, list[Any], list[Any], Array]:
    """Curves to either side and back on one ground; the poses (STEPS + 1, 3) from the start."""
    env = gym.make(
        "grouser/TrackedRobot-v0",
        terrain=terrain,
        sensors=("left", "right", "tracks"),
        dynamics="fast",
    )
    seen, info = env.reset(seed=seed)
    observations, infos = [seen], [info]
    for step in range(STEPS):
        action = ([0.5, 0.9], [0.9, 0.6], [-0.6, -0.9])[step // 20 % 3]
        seen, _, _, _, info = env.step(np.array(action, np.float32))
        observations.append(seen)
        infos.append(info)
    rig = env.get_wrapper_attr("rig")
    env.close()
    poses = np.array([told["true_pose"] for told in infos])
    return rig, observations, infos, between(poses[0], poses)


def run(rig: Rig, observations: list[Any], **options: Any) -> list[PoseEstimate]:
    estimator = make("one-point-ransac", rig, **options)
    first = estimator.reset(observations[0], rng=np.random.default_rng(0))
    return [first, *(estimator.update(o) for o in observations[1:])]


@pytest.mark.parametrize("terrain", ["gravel", "grass"])
def test_the_width_is_found_and_the_covariance_is_honest(terrain: str) -> None:
    run_nees, errors = [], []
    for seed in SEEDS:
        rig, observations, infos, truths = driven(terrain, seed)
        ill_informed = rig.with_overrides({"tracks.effective_width": 0.5})
        estimates = run(ill_informed, observations)
        steady = [k for k in range(40, STEPS) if k % 20 > 8]
        found = np.mean([estimates[k].diagnostics["effective_width"] for k in steady])
        assert abs(found / np.mean([infos[k]["effective_width"] for k in steady]) - 1) < 0.02
        poses = np.array([e.pose for e in estimates])
        covariances = np.array([e.covariance for e in estimates])
        run_nees.append(nees(truths[1:], poses[1:], covariances[1:]).mean())
        errors.append(np.hypot(*(poses[-1] - truths[-1])[:2]))
    assert 0.6 < np.mean(run_nees) < 6.5  # 3 runs, 3 samples of chi-square(3): 99.8 %
    assert np.mean(errors) < 0.01


def test_in_the_dark_the_centres_lead_better_than_scales_do() -> None:
    """Grass slows the robot in every curve, which no scale of a track says."""
    final: dict[IcrOptions | ScaleOptions, list[float]] = {IcrOptions(): [], ScaleOptions(): []}
    for seed in SEEDS:
        rig, observations, _, truths = driven("grass", seed)
        black = np.zeros_like(observations[0]["left"])
        dark = [
            o if k < 60 else dict(o) | {"left": black, "right": black}
            for k, o in enumerate(observations)
        ]
        for states, errors in final.items():
            end = run(rig, dark, slip_states=states)[-1]
            error = between(truths[-1], end.pose)
            errors.append(float(np.hypot(error[0], error[1])))
            assert error @ np.linalg.solve(end.covariance, error) < 16.3  # chi2_3(0.999)
    by_centres, by_scales = (np.mean(errors) for errors in final.values())
    assert by_centres < 0.6 * by_scales


def test_it_keeps_the_contract() -> None:
    check_pose_estimator("one-point-ransac", slip_states=ScaleOptions())


def test_other_slip_states_are_refused() -> None:
    rig = driven("gravel", 0)[0]
    with pytest.raises(
        ValueError, match=r"slip_states must be an IcrOptions or a ScaleOptions, got 'width'"
    ):
        make("one-point-ransac", rig, slip_states="width")
    with pytest.raises(ValueError, match=r"ScaleOptions.turn_sigma must be positive, got -0.1"):
        ScaleOptions(turn_sigma=-0.1)
