"""Hypotheses from one and two matches: against brute force, and with any number of outliers."""

import numpy as np
import pytest

from grouser.estimators.evaluation.consistency import nees
from grouser.estimators.monocular.camera import Matches, innovation, project
from grouser.estimators.monocular.kalman import update
from grouser.estimators.monocular.motion_model import moved
from grouser.estimators.monocular.ransac import MOST, draw_samples, ransac, trials_needed
from grouser.estimators.monocular.state import planar_covariance
from grouser.geometry import between
from grouser.geometry import project as planar
from tests.estimators.monocular import point_world as world


@pytest.mark.parametrize("sample", [1, 2])
def test_the_best_hypothesis_is_that_of_brute_force(sample: int) -> None:
    rng = np.random.default_rng(4)
    run = world.Run(rng)
    for du in world.course(6):
        run.step(du)
    T, intrinsics = world.CAMERA.T_base_camera, world.INTRINSICS
    predicted = moved(run.state, world.TRACKS.predict(np.array([0.05, 0.06]), np.zeros(5)), 0.0)
    projection = project(predicted, T, intrinsics)
    seen = np.flatnonzero(np.isfinite(projection.points[:, 0]))[:15]
    places = projection.points[seen, :2] + rng.normal(0, 1.5, (len(seen), 2))
    matches = Matches(seen, places, np.full(len(seen), 0.04))
    compared = innovation(predicted, matches, predicted, projection)
    samples = draw_samples(len(seen), sample, rng)

    def residuals(chosen: np.ndarray) -> np.ndarray:
        mask = np.isin(np.arange(len(seen)), chosen)
        hypothesis = update(predicted, compared.of(mask))
        found = project(hypothesis, T, intrinsics).points[seen, :2]
        return np.asarray(np.linalg.norm(places - found, axis=1))

    everyone = np.array([residuals(chosen) for chosen in samples])
    cost = np.minimum(everyone**2, 1.0).sum(axis=1)
    # The search may end early; it must then have found the best of those that it tried.
    told = ransac(
        predicted, matches, compared, samples=samples, threshold_px=1.0, T_base_camera=T,
        intrinsics=intrinsics,
    )  # fmt: skip
    best = everyone[np.argmin(cost[: told.trials])] < 1.0
    np.testing.assert_array_equal(told.inliers, best)


def test_samples_are_distinct_and_bounded() -> None:
    rng = np.random.default_rng(0)
    assert sorted(draw_samples(7, 1, rng)[:, 0]) == list(range(7))
    pairs = draw_samples(60, 2, rng)
    assert len(pairs) == MOST and len(np.unique(pairs, axis=0)) == MOST
    assert (pairs[:, 0] != pairs[:, 1]).all()
    assert len(draw_samples(1, 2, rng)) == 0 and len(draw_samples(0, 1, rng)) == 0


def test_the_number_of_hypotheses_is_that_of_the_paper() -> None:
    # Civera et al., eq. (17): log(1 - p) / log(1 - (1 - e)^m) with p = 0.99
    assert np.isclose(trials_needed(0.5, 1), np.log(0.01) / np.log(0.5))
    assert np.isclose(trials_needed(0.5, 2), np.log(0.01) / np.log(0.75))
    assert trials_needed(1.0, 1) == 1 and trials_needed(0.0, 2) == np.inf


@pytest.mark.parametrize("sample", [1, 2])
@pytest.mark.parametrize("outliers", [0.0, 0.2, 0.4, 0.6])
def test_wrong_matches_are_told_from_right_ones(sample: int, outliers: float) -> None:
    accepted, wrong_ones, lost, right_ones = 0, 0, 0, 0
    for seed in range(3):
        run = world.Run(np.random.default_rng(seed), sample=sample, outliers=outliers)
        for k, du in enumerate(world.course(20)):
            updated, wrong = run.step(du)
            if k >= 3:
                accepted += int((updated.inliers & wrong).sum())
                wrong_ones += int(wrong.sum())
                lost += int((~updated.inliers & ~wrong).sum())
                right_ones += int((~wrong).sum())
        error = between(planar(run.T), planar(run.state.T_start_base))
        assert np.hypot(*error[:2]) < 0.06 and abs(error[2]) < np.radians(0.5)
    assert lost <= (0.05 if outliers < 0.5 else 0.15) * right_ones
    # A wrong match may by chance lie where a right one could.
    assert accepted <= 0.1 * wrong_ones


def test_the_filter_knows_how_far_it_is_off() -> None:
    """NEES of a winding drive: near 3 for an honest filter; EKF SLAM is known to promise more."""
    poses, estimates, covariances = [], [], []
    for seed in range(10):
        run = world.Run(np.random.default_rng(seed))
        for du in world.course(60):
            run.step(du)
        poses.append(planar(run.T))
        estimates.append(planar(run.state.T_start_base))
        covariances.append(planar_covariance(run.state))
    mean = nees(np.array(poses), np.array(estimates), np.array(covariances)).mean()
    assert 1.0 < mean < 6.0


def test_the_scale_is_that_of_the_tracks() -> None:
    """Tracks that report 5 % too little make the whole world 5 % smaller; no image shows it."""
    ratios = []
    for seed in range(4):
        run = world.Run(np.random.default_rng(seed), scale=0.05)
        for _ in range(40):
            run.step(np.array([0.04, 0.04]))
        ratios.append(run.state.T_start_base[0, 3] / run.T[0, 3])
    assert np.isclose(np.mean(ratios), 1 / 1.05, atol=0.02)
