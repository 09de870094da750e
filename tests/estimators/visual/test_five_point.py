"""Five-point RANSAC: exact without noise in all six numbers, with its scale from stereo."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from grouser.estimators.visual.five_point import FivePointRansac, weighted_median
from grouser.estimators.visual.matching import Matches
from grouser.geometry import Array
from tests.estimators.visual.clouds import MOUNTS, matched, near_zero, six, stereo

NOISE = np.full(6, 0.15**2)
PRIOR = near_zero(1.0, 1.0, 1.0, 1.0)  # it takes none
FREE = np.array([0.06, 0.25, -0.03, 0.02, 0.01, -0.02])
CAMERA = stereo(MOUNTS["everything"])


@pytest.mark.parametrize("mount", MOUNTS.values(), ids=MOUNTS.keys())
@pytest.mark.parametrize("motion", [six(0.06, 0.2), six(0.0, 0.2), six(0.05, -0.15), FREE])
def test_without_noise_the_motion_is_exact_with_its_scale(mount: Array, motion: Array) -> None:
    camera = stereo(mount, fy=280.0)
    matches = matched(np.random.default_rng(0), camera, motion, n=60)
    found = FivePointRansac(camera).solve(matches, PRIOR, np.random.default_rng(1))
    assert found is not None and found.inliers.all()
    assert np.abs(found.motion - motion).max() < 1e-5


def test_a_short_step_keeps_points_that_are_hundreds_of_steps_away() -> None:
    for rng in np.random.default_rng(6).spawn(20):
        matches = matched(rng, CAMERA, six(0.02, 0.05), noise=NOISE, depth=(1.0, 20.0))
        found = FivePointRansac(CAMERA).solve(matches, PRIOR, rng)
        assert found is not None and found.inliers.mean() > 0.9
        assert np.abs(found.motion[:2] - [0.02, 0.05]).max() < 0.005


def test_half_of_the_points_may_be_wrong() -> None:
    for rng in np.random.default_rng(2).spawn(20):
        matches = matched(rng, CAMERA, FREE, n=100, noise=NOISE, outliers=50)
        found = FivePointRansac(CAMERA).solve(matches, PRIOR, rng)
        assert found is not None
        assert found.inliers[50:].mean() > 0.9
        assert found.inliers[:50].mean() < 0.25  # a wrong point may lie on its epipolar line
        error = np.abs(found.motion - FREE)
        assert error[0] < np.radians(1.0) and error[1] < 0.05


def test_the_generator_decides_and_nothing_else() -> None:
    matches = matched(np.random.default_rng(3), CAMERA, FREE, n=100, noise=NOISE, outliers=40)

    def motion(seed: int) -> bytes:
        rng = np.random.default_rng(seed)
        found = FivePointRansac(CAMERA).solve(matches, PRIOR, rng)
        assert found is not None
        return found.motion.tobytes()

    assert motion(0) == motion(0)
    assert len({motion(seed) for seed in range(8)}) > 1


def test_four_points_are_too_few() -> None:
    m = matched(np.random.default_rng(4), CAMERA, FREE, n=4)
    solver = FivePointRansac(CAMERA)
    assert solver.solve(m, PRIOR, np.random.default_rng(0)) is None
    nothing = Matches(np.empty((0, 3)), np.empty((0, 3)), np.empty((0, 6)), 0)
    assert solver.solve(nothing, PRIOR, np.random.default_rng(0)) is None


def test_at_rest_it_gives_no_motion_of_any_size() -> None:
    """Without parallax the direction is noise, but then stereo says that its length is nothing."""
    for rng in np.random.default_rng(5).spawn(20):
        matches = matched(rng, CAMERA, np.zeros(6), noise=NOISE, depth=(0.8, 5.0))
        found = FivePointRansac(CAMERA).solve(matches, PRIOR, rng)
        assert found is None or np.linalg.norm(found.motion[1:4]) < 0.03


@given(st.lists(st.tuples(st.floats(-9, 9), st.integers(1, 20)), min_size=1, max_size=20))
def test_half_the_weight_lies_below_the_weighted_median(pairs: list[tuple[float, int]]) -> None:
    values, counts = (np.array(part) for part in zip(*pairs, strict=True))
    repeated = np.sort(np.repeat(values, counts))
    expected = repeated[(len(repeated) - 1) // 2]  # the lower median
    assert weighted_median(values, counts.astype(float)) == expected
