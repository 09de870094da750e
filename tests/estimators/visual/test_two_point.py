"""Alignment of two points' plan views: the least squares it claims, and where it has no answer."""

import numpy as np
from scipy.optimize import least_squares

from grouser.estimators.visual.two_point import TwoPointRansac, align_plans
from grouser.rig import camera_mount
from tests.estimators.visual.clouds import matched, near_zero, six, stereo

CAMERA = stereo(camera_mount(0.15, 0.05, 0.4, pitch=0.17))


def test_it_is_the_least_squares_over_turn_and_shift() -> None:
    """More points than two overdetermine it: against a general optimiser."""
    rng = np.random.default_rng(0)
    before = rng.uniform(1, 5, 6) + 1j * rng.uniform(-2, 2, 6)
    inverse = rng.uniform(0.2, 1.0, 6)
    noise = 0.1 * (rng.normal(size=6) + 1j * rng.normal(size=6))
    after = np.exp(0.3j) * before + inverse * (0.2 - 0.4j) + noise
    turn, shift = align_plans(before[None], after[None], inverse[None])

    def residuals(x: np.ndarray) -> np.ndarray:
        off = after - np.exp(1j * x[0]) * before - inverse * (x[1] + 1j * x[2])
        return np.concatenate([off.real, off.imag])

    best = least_squares(residuals, [0.3, 0.2, -0.4], xtol=1e-14, ftol=1e-14, gtol=1e-14).x
    np.testing.assert_allclose([turn[0], shift[0].real, shift[0].imag], best, atol=1e-6)


def test_rows_are_alone_and_one_point_twice_has_no_turn() -> None:
    before = np.array([[1 + 1j, 2 - 1j], [1 + 1j, 1 + 1j]])
    inverse = np.array([[0.5, 0.25], [0.5, 0.5]])
    after = np.exp(0.2j) * before + inverse * (0.1 + 0.3j)
    turn, shift = align_plans(before, after, inverse)
    np.testing.assert_allclose([turn[0], shift[0]], [0.2, 0.1 + 0.3j], atol=1e-14)
    assert np.isnan(turn[1])


def test_a_chassis_that_pitches_keeps_its_inliers_thanks_to_the_tolerance() -> None:
    """As one-point's: what the model leaves out must be tolerated, or far points are lost."""
    rigid: list[float] = []
    tolerant: list[float] = []
    noise = np.full(6, 0.1**2)
    for rng in np.random.default_rng(1).spawn(20):
        pitched = six(0.03, 0.1, 0.01, 0.0, 0.0, np.radians(0.2))
        matches = matched(rng, CAMERA, pitched, noise=noise)
        for kept, tilt in ((rigid, 1e-6), (tolerant, 0.005)):
            found = TwoPointRansac(CAMERA).solve(matches, near_zero(1.0, tilt, tilt, tilt), rng)
            assert found is not None and not found.motion[3:].any()
            kept.append(found.inliers.mean())
    assert np.mean(tolerant) > 0.97
    assert np.mean(rigid) < 0.92
