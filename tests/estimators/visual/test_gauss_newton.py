"""The refinement's iteration against the same in plain NumPy, point by point as SPEC 1.6 has it."""

import numpy as np
import pytest
from numpy.typing import NDArray

from grouser.estimators.visual.gauss_newton import (
    CAUCHY,
    GATE,
    LEAST_SCALE,
    MEDIAN_ERROR,
    gauss_newton,
)
from grouser.estimators.visual.matching import Matches
from grouser.estimators.visual.motion import camera_motion, intrinsics, measure
from grouser.estimators.visual.prior import MotionPrior
from grouser.geometry import Array
from grouser.rig import StereoCamera, camera_mount
from tests.estimators.visual.clouds import matched, near_zero, six, stereo

CAMERA = stereo(camera_mount(0.15, 0.05, 0.4, roll=0.02, pitch=0.17, yaw=0.03), fy=250.0)
NOISE = np.array([0.01, 0.02, 0.09, 0.04, 0.03, 0.16])
PRIOR = near_zero(0.01, 0.01, 0.005, 0.004)
TRUTH = np.array([0.05, 0.12, -0.01, 0.008, 0.006, -0.004])
START = six(0.055, 0.1)


def printed(
    matches: Matches,
    supporters: NDArray[np.bool_],
    prior: MotionPrior,
    camera: StereoCamera,
    iterations: int,
) -> tuple[Array, Array, Array, Array]:
    """Motion, information of the weighted points, derivative by a disparity offset, errors."""
    motion, corrected, n = START.copy(), matches.reference.copy(), len(matches.reference)
    information = np.diag(prior.sigma**-2.0)
    for _ in range(iterations):
        moving, mapped = camera_motion(motion, camera.T_base_camera), []
        for i in range(n):
            p, Jw, Jm = np.empty(3), np.empty((3, 3)), np.empty((3, 6))
            assert measure(corrected[i], *moving, intrinsics(camera), p, Jw, Jm)
            before, now = np.diag(matches.noise[i, :3]), np.diag(matches.noise[i, 3:])
            r = matches.current[i] - p - Jw @ (matches.reference[i] - corrected[i])
            mapped.append((r, Jw, Jm, before, np.linalg.inv(now + Jw @ before @ Jw.T)))
        errors = np.array([r @ W @ r for r, _, _, _, W in mapped])
        scale = max(LEAST_SCALE, np.median(errors[supporters]) / MEDIAN_ERROR)
        H, g, h = np.zeros((6, 6)), information @ (prior.mean - motion), np.zeros(6)
        inliers = np.flatnonzero(errors < GATE * scale)
        for i in map(int, inliers):
            r, Jw, Jm, _, W = mapped[i]
            weight = 1 / (1 + errors[i] / (CAUCHY * scale))
            H += weight * Jm.T @ W @ Jm
            g += weight * Jm.T @ W @ r
            h += weight * Jm.T @ W @ (np.array([0.0, 0.0, 1.0]) - Jw[:, 2])
        change = np.linalg.solve(H + information, g)
        for i in map(int, inliers):
            r, Jw, Jm, before, W = mapped[i]
            corrected[i] = matches.reference[i] + before @ Jw.T @ W @ (r - Jm @ change)
        motion = motion + change
    return motion, H, np.asarray(np.linalg.solve(H + information, h)), errors


@pytest.mark.parametrize("iterations", [1, 2, 5])
def test_it_does_what_is_printed(iterations: int) -> None:
    rng = np.random.default_rng(0)
    matches = matched(rng, CAMERA, TRUTH, n=40, noise=NOISE, outliers=9)
    supporters = np.arange(40) >= 9
    motion, points, by_disparity, errors = printed(matches, supporters, PRIOR, CAMERA, iterations)
    found = gauss_newton(
        matches.reference, matches.current, START, supporters, PRIOR.mean, PRIOR.sigma**-2.0,
        matches.noise, np.ones(len(matches.noise)), CAMERA.T_base_camera, intrinsics(CAMERA),
        iterations,
    )  # fmt: skip
    np.testing.assert_allclose(found[0], motion, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(found[1], points, rtol=1e-8, atol=1e-6 * np.abs(points).max())
    np.testing.assert_allclose(found[2], by_disparity, rtol=1e-8, atol=1e-12)
    np.testing.assert_allclose(found[3], errors, rtol=1e-8)
    assert found[5] == iterations


def test_it_stops_where_a_step_is_a_hundredth_of_a_sigma() -> None:
    """And another 30 iterations would not have moved it by much more than that."""
    for rng in np.random.default_rng(1).spawn(20):
        matches = matched(rng, CAMERA, TRUTH, noise=NOISE, outliers=6)
        problem = (
            matches.reference, matches.current, START, np.arange(64) >= 6, PRIOR.mean,
            PRIOR.sigma**-2.0, matches.noise, np.ones(64), CAMERA.T_base_camera, intrinsics(CAMERA),
        )  # fmt: skip
        motion, points, _, _, _, steps = gauss_newton(*problem, 40)
        assert steps < 20
        further = printed(matches, problem[3], PRIOR, CAMERA, steps + 10)[0]
        step = further - motion
        assert step @ (points + np.diag(PRIOR.sigma**-2.0)) @ step < 0.03**2


def test_a_point_behind_the_camera_is_an_outlier() -> None:
    matches = matched(np.random.default_rng(2), CAMERA, TRUTH, n=20)
    matches.reference[0, 2] = 1e4  # a centimetre away, and the robot drives past it
    _, _, _, errors, _, _ = gauss_newton(
        matches.reference, matches.current, START, np.arange(20) >= 1, PRIOR.mean,
        PRIOR.sigma**-2.0, matches.noise, np.ones(20), CAMERA.T_base_camera, intrinsics(CAMERA), 5,
    )  # fmt: skip
    assert np.isinf(errors[0]) and np.isfinite(errors[1:]).all()
