"""SIFT as a kind of features: where they are, what they are compared by, and what they lead to."""

import numpy as np
import pytest

from grouser.estimators import make
from grouser.estimators.synthetic_drive import RIG, synthetic_drive
from grouser.estimators.visual.descriptor import PATCH_RADIUS, match_rows, squared_length
from grouser.estimators.visual.fast import FastFeatures
from grouser.estimators.visual.frontend import FrontendOptions, StereoFrontend
from grouser.estimators.visual.sift import SiftFeatures
from grouser.geometry import between
from tests.estimators.visual.pictures import blocks

IMAGE = blocks(np.random.default_rng(0), width=400)
LEFT = np.ascontiguousarray(IMAGE[:, 40:360])
RIGHT = np.ascontiguousarray(IMAGE[:, 50:370])  # a wall at a disparity of 10


def test_features_are_ordered_spread_and_each_at_a_place_of_its_own() -> None:
    found, _ = SiftFeatures(600).extract(LEFT, RIGHT)
    x, y = found.places.T
    assert 400 < len(x) <= 600
    assert (np.diff(y) >= 0).all() and len(np.unique(found.places, axis=0)) == len(x)
    assert min(x.min(), y.min()) >= PATCH_RADIUS
    assert x.max() < 320 - PATCH_RADIUS and y.max() < 240 - PATCH_RADIUS
    cells = np.histogram2d(x, y, (4, 3), ((0, 320), (0, 240)))[0]
    assert cells.min() > 20 and cells.max() <= 50
    assert found.descriptors.shape == (len(x), 128) and found.descriptors.dtype == np.uint8


def test_a_wall_gets_its_disparity() -> None:
    frame = StereoFrontend(FrontendOptions(corners=600, features="sift")).extract(LEFT, RIGHT)
    assert len(frame.points) > 400
    assert np.mean(np.abs(frame.points[:, 2] - 10) <= 1) > 0.99


def test_vectors_are_compared_by_their_squared_length_and_bits_by_their_number() -> None:
    """The same kernels serve both: against every pair, by NumPy."""
    rng = np.random.default_rng(1)
    a, b = rng.integers(0, 256, (2, 30, 128), dtype=np.uint8)
    b[::3] = a[::3] // 2 + a[::3] // 3
    far = ((a[:, None].astype(int) - b[None].astype(int)) ** 2).sum(axis=-1)
    assert all(squared_length(a[i], b[j]) == far[i, j] for i in range(30) for j in range(30))
    places = np.stack([np.arange(30), np.zeros(30, int)], axis=-1).astype(np.int32)
    everywhere = match_rows(places + [50, 0], a, places, b, 1, 0, 100, 1 << 30, 1.0)
    paired = np.flatnonzero(everywhere >= 0)
    assert len(paired) > 10
    np.testing.assert_array_equal(everywhere[paired], far[paired].argmin(axis=1))
    careful = match_rows(places + [50, 0], a, places, b, 1, 0, 100, 1 << 30, 0.64)
    best, second = np.sort(far, axis=1)[:, :2].T
    np.testing.assert_array_equal(careful >= 0, (everywhere >= 0) & (best <= 0.64 * second))
    assert 5 < np.sum(careful >= 0) < len(paired)


@pytest.mark.parametrize("kind", [FastFeatures, SiftFeatures])
def test_in_the_dark_there_are_no_features_but_of_the_right_kind(
    kind: type[FastFeatures] | type[SiftFeatures],
) -> None:
    lit, _ = kind(300).extract(LEFT, RIGHT)
    black = np.zeros((240, 320), dtype=np.uint8)
    for found in kind(300).extract(black, black):
        assert len(found.places) == 0
        assert found.descriptors.shape == (0, lit.descriptors.shape[1])
        assert found.descriptors.dtype == lit.descriptors.dtype


def test_visual_odometry_on_sift_follows_the_drive() -> None:
    room = synthetic_drive(frames=9, blackout=range(0))
    estimator = make("one-point-ransac", RIG, features="sift")
    estimator.reset(room.observations[0], rng=np.random.default_rng(0))
    for observation in room.observations[1:]:
        estimate = estimator.update(observation)
        assert estimate.diagnostics["inliers"] > 25
    error = between(room.poses[-1], estimate.pose)
    assert np.abs(error[:2]).max() < 0.01 and abs(error[2]) < np.radians(0.2)
