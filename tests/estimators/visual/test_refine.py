"""Refinement: exact without noise, honest under it, unbiased at rest, unmoved by outliers."""

import numpy as np
import pytest

from grouser.estimators.visual.matching import Matches
from grouser.estimators.visual.motion import camera_motion, intrinsics, measure
from grouser.estimators.visual.prior import MotionPrior
from grouser.estimators.visual.refine import Refinement, refine
from grouser.geometry import Array
from grouser.rig import StereoCamera, camera_mount
from tests.estimators.visual.clouds import MOTIONS, matched, near_zero, six, stereo

CAMERA = stereo(camera_mount(0.15, 0.05, 0.4, pitch=0.17))
NOISE = np.full(6, 0.3**2)
PLANAR = near_zero(1e-7, 1e-7, 1e-7, 1e-7, vague=1e6)
LOOSE = near_zero(0.01, 0.01, 0.005, 0.005)
ANYTHING = near_zero(1e4, 1e4, 1e4, 1e4, vague=1e4)


def refined(
    matches: Matches,
    *,
    start: Array,
    prior: MotionPrior = PLANAR,
    noise: Array = NOISE,
    camera: StereoCamera = CAMERA,
    outliers: int = 0,
) -> Refinement:
    supporters = np.arange(len(matches.reference)) >= outliers
    return refine(
        matches.reference,
        matches.current,
        start=start,
        supporters=supporters,
        prior=prior,
        noise=np.tile(noise, (len(matches.reference), 1)),
        T_base_camera=camera.T_base_camera,
        camera=intrinsics(camera),
    )


@pytest.mark.parametrize("motion", MOTIONS.values(), ids=MOTIONS.keys())
def test_without_noise_the_planar_motion_is_exact(motion: tuple[float, float]) -> None:
    truth = six(*motion)
    matches = matched(np.random.default_rng(0), CAMERA, truth, depth=(1.5, 9.0))
    result = refined(matches, start=truth + six(0.01, -0.02))
    assert np.abs(result.motion - truth).max() < 1e-9
    assert result.inliers.all()


def test_without_noise_all_six_numbers_are_found() -> None:
    truth = np.array([0.05, 0.1, -0.01, 0.008, 0.006, -0.01])
    matches = matched(np.random.default_rng(1), CAMERA, truth)
    result = refined(matches, start=six(0.05, 0.1), prior=ANYTHING)
    assert np.abs(result.motion - truth).max() < 1e-7


def test_points_that_are_counted_twice_at_half_a_share_change_nothing() -> None:
    """Neither the motion nor how sure it is said to be; at a whole share it would be surer."""
    truth = np.array([0.05, 0.1, -0.01, 0.008, 0.006, -0.01])
    once = matched(np.random.default_rng(4), CAMERA, truth, noise=NOISE)
    twice = [np.repeat(points, 2, axis=0) for points in (once.reference, once.current)]

    def result(points: list[Array], share: float) -> Refinement:
        n = len(points[0])
        return refine(
            *points,
            start=truth,
            supporters=np.ones(n, dtype=bool),
            prior=ANYTHING,
            noise=np.tile(NOISE, (n, 1)),
            T_base_camera=CAMERA.T_base_camera,
            camera=intrinsics(CAMERA),
            shares=np.full(n, share),
        )

    alone, halves = result([once.reference, once.current], 1.0), result(twice, 0.5)
    np.testing.assert_allclose(halves.motion, alone.motion, atol=1e-6)
    np.testing.assert_allclose(halves.covariance, alone.covariance, rtol=0.1, atol=1e-12)
    trusting = result(twice, 1.0)
    assert np.trace(trusting.covariance) < 0.65 * np.trace(alone.covariance)


def test_turn_and_chord_are_as_uncertain_as_said() -> None:
    """SPEC's acceptance: a frame's NEES of (turn, chord) in [1.7, 2.4]; two would be ideal."""
    truth, nees, ratio = six(0.03, 0.1), [], []
    for rng in np.random.default_rng(2).spawn(500):
        result = refined(matched(rng, CAMERA, truth, noise=NOISE), start=truth)
        error = (result.motion - truth)[:2]
        nees.append(error @ np.linalg.solve(result.covariance[:2, :2], error))
        ratio.append(result.noise_ratio)
    assert 1.7 < np.mean(nees) < 2.4
    assert np.mean(ratio) == pytest.approx(1, abs=0.1)


@pytest.mark.parametrize(("n", "depth"), [(64, (0.8, 9.0)), (12, (4.0, 9.0))])
def test_six_numbers_drawn_from_their_prior_are_as_uncertain_as_said(
    n: int, depth: tuple[float, float]
) -> None:
    """Twelve far points tell little of the last four, which then are as uncertain as before."""
    prior, nees, ratios = near_zero(0.003, 0.003, 0.002, 0.002), [], []
    for rng in np.random.default_rng(3).spawn(300):
        truth = np.append([0.03, 0.1], prior.sigma[2:] * rng.normal(size=4))
        matches = matched(rng, CAMERA, truth, n=n, noise=NOISE, depth=depth)
        result = refined(matches, start=six(0.03, 0.1), prior=prior)
        error = result.motion - truth
        nees.append(error @ np.linalg.solve(result.covariance, error))
        ratios.append(error**2 / np.diag(result.covariance))
    assert 5.3 < np.mean(nees) < 7.0  # 6 is ideal; the mean of 300 has a sigma of 0.2
    assert np.mean(ratios, axis=0) == pytest.approx(np.ones(6), abs=0.3)


def test_noise_three_times_the_assumed_is_noticed_and_borne() -> None:
    truth, nees, ratio = six(0.03, 0.1), [], []
    for rng in np.random.default_rng(4).spawn(200):
        result = refined(matched(rng, CAMERA, truth, noise=9 * NOISE), start=truth)
        assert result.inliers.mean() > 0.9
        error = (result.motion - truth)[:2]
        honest = result.covariance[:2, :2]
        nees.append(error @ np.linalg.solve(honest, error))
        ratio.append(result.noise_ratio)
    assert np.median(ratio) == pytest.approx(9, rel=0.2)
    assert 1.5 < np.mean(nees) < 2.7


def test_gross_outliers_are_refused_and_cost_nothing() -> None:
    truth, wrong, clean, dirty, kept, lost = six(0.03, 0.1), 27, [], [], [], []
    start = truth + six(0.005, -0.01)
    for rng in np.random.default_rng(5).spawn(200):
        matches = matched(rng, CAMERA, truth, n=91, noise=NOISE, outliers=wrong)
        alone = Matches(
            matches.reference[wrong:], matches.current[wrong:], matches.noise[wrong:], 64
        )
        result = refined(matches, start=start, outliers=wrong)
        dirty.append(result.motion - truth)
        clean.append(refined(alone, start=start).motion - truth)
        kept.append(result.inliers[:wrong].mean())
        lost.append(1 - result.inliers[wrong:].mean())
    assert np.mean(kept) < 0.02 and np.mean(lost) < 0.02
    loss = np.std(dirty, axis=0)[:2] / np.std(clean, axis=0)[:2]
    assert (loss < 1.1).all()


def plain_reprojection(matches: Matches, truth: Array) -> Array:
    """(turn, chord) that minimise the error of the noisy reference points, moved: no correction."""
    moving = camera_motion(truth, CAMERA.T_base_camera)
    p, Jw, Jm = np.empty(3), np.empty((3, 3)), np.empty((3, 6))
    H, g = np.zeros((2, 2)), np.zeros(2)
    for before, now in zip(matches.reference, matches.current, strict=True):
        assert measure(before, *moving, intrinsics(CAMERA), p, Jw, Jm)
        information = np.linalg.inv(Jw @ Jw.T + np.eye(3))
        H += Jm[:, :2].T @ information @ Jm[:, :2]
        g += Jm[:, :2].T @ information @ (now - p)
    return truth[:2] + np.linalg.solve(H, g)


def test_at_rest_the_chord_has_no_bias_where_plain_reprojection_has() -> None:
    """SPEC 1.6: noise of the reference point in the Jacobian shortens every chord."""
    rest, runs, pixel = np.zeros(6), 150, np.ones(6)
    ours, plain = np.empty(runs), np.empty(runs)
    for i, rng in enumerate(np.random.default_rng(6).spawn(runs)):
        matches = matched(rng, CAMERA, rest, noise=pixel, n=200)
        ours[i] = refined(matches, start=rest, noise=pixel).motion[1]
        plain[i] = plain_reprojection(matches, rest)[1]
    sigmas = np.sqrt(runs) * np.array([ours.mean() / ours.std(), plain.mean() / plain.std()])
    assert abs(sigmas[0]) < 2.5 < 4 < abs(sigmas[1])


def test_without_information_the_prior_is_what_remains() -> None:
    """Points at infinity hold the turn and nothing of the displacement."""
    mean = np.array([0.0, 0.1, 0.02, -0.01, 0.0, 0.0])
    prior = MotionPrior(mean, LOOSE.sigma)
    matches = matched(np.random.default_rng(7), CAMERA, six(0.05, 0.0), depth=(1e9, 1e10))
    matches.reference[:, 2] = matches.current[:, 2] = 0.0
    result = refined(matches, start=np.zeros(6), prior=prior)
    assert result.motion[0] == pytest.approx(0.05, abs=1e-5)
    np.testing.assert_allclose(result.motion[1:4], mean[1:4], atol=1e-6)
    np.testing.assert_allclose(np.diag(result.covariance)[1:4], prior.sigma[1:4] ** 2, rtol=1e-4)


def test_by_disparity_is_what_an_offset_of_all_disparities_does() -> None:
    truth, offset = np.array([0.04, 0.15, 0.01, 0.0, 0.004, -0.006]), 1e-3
    matches = matched(np.random.default_rng(8), CAMERA, truth)

    def motion(d: float) -> Array:
        shifted = [points + [0.0, 0.0, d] for points in (matches.reference, matches.current)]
        return refined(
            Matches(shifted[0], shifted[1], matches.noise, 64), start=truth, prior=LOOSE
        ).motion

    difference = (motion(offset) - motion(-offset)) / (2 * offset)
    stated = refined(matches, start=truth, prior=LOOSE).by_disparity
    np.testing.assert_allclose(stated, difference, rtol=0.02, atol=2e-5)
    assert abs(stated[1]) > 1e-3, "distances hang on the disparity"
