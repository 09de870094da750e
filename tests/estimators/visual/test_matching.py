"""Matching over time: inside the search ellipse, spread over the image, warped as surfaces are."""

import numpy as np
import pytest

from grouser.estimators.visual.frontend import (
    FrontendOptions,
    Keyframe,
    StereoFrame,
    StereoFrontend,
)
from grouser.estimators.visual.matching import (
    Matches,
    MatchingOptions,
    PixelNoise,
    Prediction,
    match_frames,
    own_shares,
    spread,
    surface_warp,
)
from grouser.estimators.visual.motion import intrinsics, predict_points
from grouser.estimators.visual.odometry import _ALIGNMENT_BIAS
from grouser.geometry import Array
from tests.estimators.visual.clouds import MOUNTS, moved, points_of, seen, stereo
from tests.estimators.visual.pictures import Scene

SCENE = Scene(np.random.default_rng(0))
DISPARITY = 10
NOISE = PixelNoise()


def wall(
    dx: float = 0.0, dy: float = 0.0, disparity: float = DISPARITY, offset: int = 0
) -> StereoFrame:
    """A wall at one disparity; a point of it is seen dx, dy further right and down."""
    frontend = StereoFrontend(FrontendOptions(corners=600), disparity_offset=float(offset))
    return frontend.extract(SCENE.view(dx, dy), SCENE.view(dx - disparity - offset, dy))


def keyframe(offset: int = 0) -> Keyframe:
    frontend = StereoFrontend(FrontendOptions(corners=600), disparity_offset=float(offset))
    return frontend.make_keyframe(wall(offset=offset))


def expected(key: Keyframe, dx: float, dy: float, sigma: float) -> Prediction:
    """All points moved by dx, dy [px], give or take sigma."""
    n = len(key.points)
    covariance = np.tile(np.diag([sigma, sigma, 1.0]) ** 2, (n, 1, 1))
    return Prediction(key.points + [dx, dy, 0.0], covariance, np.tile(np.eye(3), (n, 1, 1)))


def matches(prediction: Prediction, frame: StereoFrame, max_points: int = 64) -> Matches:
    return match_frames(
        KEY, frame, prediction, MatchingOptions(max_points=max_points), NOISE, disparity_offset=0.0
    )


KEY = keyframe()
MOVED = wall(6, -4)


@pytest.mark.parametrize("fraction", [0.0, 0.125, 0.25, 0.5, 0.75, 0.875])
def test_points_are_found_where_they_went_to_a_fraction_of_a_pixel(fraction: float) -> None:
    """What all points share is the worst of it: no number of points averages it out."""
    motion = np.array([6.0 + fraction, -4.0 - fraction, fraction])
    moved = wall(motion[0], motion[1], DISPARITY + fraction)
    found = matches(expected(KEY, 5.0, -3.0, 1.5), moved)
    assert len(found.reference) > 50
    error = found.current - found.reference - motion
    assert np.abs(np.median(error, axis=0)).max() < _ALIGNMENT_BIAS
    assert np.median(np.abs(error), axis=0).max() < 0.05


def test_a_disparity_offset_is_no_disparity() -> None:
    """With the camera's offset told, points are as far away as without one."""
    key = keyframe(offset=3)
    prediction = expected(key, 6.0, -4.0, 1.0)
    found = match_frames(
        key, wall(6, -4, offset=3), prediction, MatchingOptions(), NOISE, disparity_offset=3.0
    )
    assert len(found.reference) > 50
    assert np.median(found.reference[:, 2]) == pytest.approx(DISPARITY, abs=0.02)
    assert np.median(found.current[:, 2]) == pytest.approx(DISPARITY, abs=0.02)


@pytest.mark.parametrize("sigma", [0.1, 2.0, 5.0])
def test_nothing_outside_the_search_ellipse_is_a_match(sigma: float) -> None:
    """A prediction may be wrong by three sigma, and by a corner's own scatter."""
    reach = np.sqrt(9.21 * (sigma**2 + 1.0))  # chi-square of 2 at 99 %

    def right(error: float) -> int:
        found = matches(expected(KEY, 6.0 - error, -4.0, sigma), MOVED, max_points=1000)
        gone = found.current - found.reference - [6.0, -4.0, 0.0]
        return int((np.abs(gone) < 0.5).all(axis=1).sum())

    assert right(0.8 * reach) > 100
    assert right(1.1 * reach + 3.0) == 0, "alignment may mend 2.5 px beyond it"


def test_a_disparity_that_cannot_be_is_no_match() -> None:
    prediction = expected(KEY, 6.0, -4.0, 1.0)
    far = Prediction(prediction.points - [0, 0, 5.0], prediction.covariance, prediction.by_point)
    assert matches(prediction, MOVED).candidates > 100
    assert matches(far, MOVED).candidates == 0


def test_points_behind_the_camera_are_not_sought() -> None:
    prediction = expected(KEY, 6.0, -4.0, 1.0)
    prediction.points[::2] = np.nan
    prediction.covariance[::2] = np.nan
    found = matches(prediction, MOVED, max_points=1000)
    sought = {tuple(point) for point in KEY.points[1::2]}
    assert len(found.reference) > 50
    assert all(tuple(point) in sought for point in found.reference)


def test_no_feature_is_matched_twice() -> None:
    found = matches(expected(KEY, 6.0, -4.0, 4.0), MOVED, max_points=1000)
    assert len(found.reference) > 150
    for side in (found.reference, np.rint(found.current)):
        assert len(np.unique(side[:, :2], axis=0)) == len(side)


@pytest.mark.parametrize("most", [16, 64])
def test_at_most_the_wanted_points_spread_over_the_image(most: int) -> None:
    found = matches(expected(KEY, 6.0, -4.0, 1.0), MOVED, max_points=most)
    assert 0.8 * most < len(found.reference) <= most < found.candidates
    quadrant = (found.current[:, 0] > 160) + 2 * (found.current[:, 1] > 120)
    assert np.bincount(quadrant, minlength=4).min() >= most / 8


def two_walls(dx: int, dy: int) -> StereoFrame:
    """The upper half of the scene is nearer than the lower one."""
    near, far, boundary = SCENE.view(dx - 14, dy), SCENE.view(dx - 5, dy), 120 + dy
    right = np.concatenate([near[:boundary], far[boundary:]])
    return StereoFrontend(FrontendOptions(corners=600)).extract(SCENE.view(dx, dy), right)


def test_within_a_bucket_near_points_come_first() -> None:
    key = StereoFrontend(FrontendOptions()).make_keyframe(two_walls(0, 0))
    assert 0.3 < (key.points[:, 2] > 10).mean() < 0.7
    options = MatchingOptions(max_points=40, buckets=(1, 1))
    prediction = expected(key, 6.0, -4.0, 1.0)
    found = match_frames(key, two_walls(6, -4), prediction, options, NOISE, disparity_offset=0.0)
    assert len(found.current) > 30 and (found.current[:, 2] > 10).mean() > 0.9


def test_spread_takes_the_best_of_every_bucket_before_any_second() -> None:
    rng, options = np.random.default_rng(1), MatchingOptions(max_points=40, buckets=(8, 6))
    points = rng.uniform(0, [160, 240, 10], (300, 3))  # half of the image is empty
    score = rng.uniform(size=300)
    chosen = spread(points, score, options, 320, 240)
    assert len(chosen) == 40 and (np.diff(chosen) > 0).all()
    bucket = (points[:, 0] // 40 + 8 * (points[:, 1] // 40)).astype(int)
    count = np.bincount(bucket[chosen], minlength=48)
    occupied = np.unique(bucket)
    assert len(occupied) == 24 and count[occupied].min() >= 1 and count.max() <= 2
    for b in occupied:
        inside = np.flatnonzero(bucket == b)
        best = inside[np.argsort(-score[inside])][: count[b]]
        assert set(best) == set(chosen[bucket[chosen] == b])


def test_fewer_points_than_wanted_are_all_kept() -> None:
    points, score = np.array([[1.0, 1.0, 1.0], [2.0, 2.0, 1.0]]), np.zeros(2)
    np.testing.assert_array_equal(spread(points, score, MatchingOptions(), 320, 240), [0, 1])
    assert len(spread(points[:0], score[:0], MatchingOptions(), 320, 240)) == 0


def test_a_patch_that_looks_another_way_is_found_less_exactly() -> None:
    """A keyframe's point is where it was cut; stretch and shear add to the noise of the other."""
    warps, rich = np.array([np.eye(2), 1.2 * np.eye(2)]), np.zeros((2, 2))
    alike, stretched = NOISE.of_patches(warps, rich)
    np.testing.assert_array_equal(alike, NOISE.expected())
    np.testing.assert_allclose(np.sqrt(alike[2:]), [0.1, 0.08, 0.08, 0.1])
    assert (stretched[3:5] > alike[3:5]).all()
    np.testing.assert_array_equal(stretched[[0, 1, 2, 5]], alike[[0, 1, 2, 5]])
    found = matches(expected(KEY, 6.0, -4.0, 1.0), MOVED)
    assert found.noise.shape == (len(found.reference), 6)
    assert found.shares is not None and found.shares.shape == (len(found.reference),)


def test_a_skyline_hardly_tells_where_along_it_one_is() -> None:
    skyline = NOISE.of_patches(np.eye(2)[None], np.array([[4e-3, 1e-5]]))[0]
    assert skyline[3] > 4 * skyline[4]
    assert skyline[4] == pytest.approx(NOISE.place**2, rel=0.05)


def test_points_on_the_same_pixels_are_one_witness_together() -> None:
    far = np.array([[10.0, 10.0], [40.0, 10.0], [10.0, 40.0]])
    np.testing.assert_array_equal(own_shares(far, 13.0), 1.0)
    same = own_shares(np.repeat(far, 4, axis=0), 13.0)
    np.testing.assert_allclose(same, 1 / 4)
    near = own_shares(np.array([[10.0, 10.0], [16.5, 10.0]]), 13.0)
    np.testing.assert_allclose(near, 1 / 1.5)
    rng = np.random.default_rng(0)
    crowd = own_shares(rng.uniform(0, 50, (200, 2)), 13.0)
    assert (crowd > 0).all() and (crowd <= 1).all()
    # No more witnesses than there is room for: 200 patches lie on 19 patches' worth of pixels.
    assert crowd.sum() < 2 * (50 + 13) ** 2 / 13**2
    assert own_shares(far[:0], 13.0).shape == (0,)


def test_the_warp_of_a_plane_is_the_derivative_of_its_image() -> None:
    camera = stereo(MOUNTS["everything"])
    motion = np.array([0.1, 0.3, -0.02, 0.01, 0.03, -0.04])
    normal, distance = np.array([0.1, -0.9, -0.3]), -1.2  # points of the plane: normal . P = d
    n_u, n_v, n_1 = normal / [camera.fx, camera.fy, 1.0]

    def on_plane(u: float, v: float) -> Array:
        """(1, 3) u, v, d of the plane seen at a pixel: d is linear in u and v."""
        x, y = u - camera.cx, v - camera.cy
        inverse_depth = (n_u * x + n_v * y + n_1) / distance
        return np.array([[u, v, inverse_depth * camera.fx * camera.baseline]])

    def image(u: float, v: float) -> Array:
        points = points_of(on_plane(u, v), camera)
        return seen(moved(points, motion, camera.T_base_camera), camera)[0, :2]

    u, v, h = 200.0, 190.0, 1e-4
    columns = [image(u + h, v) - image(u - h, v), image(u, v + h) - image(u, v - h)]
    _, _, by_point = predict_points(
        on_plane(u, v),
        motion,
        np.zeros((6, 6)),
        camera.T_base_camera,
        intrinsics(camera),
        np.zeros(6),
    )
    slopes = np.array([[n_u, n_v]]) / distance * camera.fx * camera.baseline
    warp = surface_warp(by_point, slopes)[0]
    np.testing.assert_allclose(warp, np.stack(columns, axis=1) / (2 * h), atol=1e-6)
