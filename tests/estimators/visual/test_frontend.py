"""Stereo processing: partners along the rows, disparities as calibrated, words for bad images."""

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from grouser.estimators.visual.descriptor import Descriptors, Image, hamming, match_rows
from grouser.estimators.visual.frontend import FrontendOptions, StereoFrontend, grey
from tests.estimators.visual.pictures import blocks

IMAGE = blocks(np.random.default_rng(0), width=400)


def pair(disparity: int, rows: int = 0) -> tuple[Image, Image]:
    """A wall at one disparity, the right eye's rows displaced."""
    left = np.ascontiguousarray(IMAGE[10:230, 40:360])
    top = 10 + rows
    right = IMAGE[top : top + 220, 40 + disparity : 360 + disparity]
    return left, np.ascontiguousarray(right)


Corners = NDArray[np.int32]


def features(rng: np.random.Generator, n: int) -> tuple[Corners, Descriptors]:
    """Corners (n, 2) ordered by row, with descriptors of which many nearly agree."""
    corners = rng.integers(0, [60, 30], (n, 2)).astype(np.int32)
    corners = corners[np.lexsort((corners[:, 0], corners[:, 1]))]
    words = np.random.default_rng(9).integers(0, 2**63, (6, 4)).astype(np.uint64)
    descriptors = words[rng.integers(0, 6, n)]
    noise = np.uint64(1) << rng.integers(0, 64, (n, 4)).astype(np.uint64)
    return corners, descriptors ^ noise


def test_partners_lie_in_nearby_rows_within_the_range_and_are_each_others_best() -> None:
    """Against every pair: no corner keeps a partner that prefers another one which it has."""
    rng = np.random.default_rng(1)
    for _ in range(20):
        left, a = features(rng, 80)
        right, b = features(rng, 80)
        partner = match_rows(left, a, right, b, 30, 1, 25, 64, 1.0)
        bits = np.array([[hamming(x, y) for y in b] for x in a])
        disparity = left[:, None, 0] - right[None, :, 0]
        allowed = (np.abs(left[:, None, 1] - right[None, :, 1]) <= 1) & (bits < 64)
        allowed &= (disparity >= 0) & (disparity <= 25)
        bits = np.where(allowed, bits, 999)
        matched = np.flatnonzero(partner >= 0)
        assert len(matched) > 10
        assert len(set(partner[matched])) == len(matched), "one partner each"
        assert (bits[matched, partner[matched]] == bits[matched].min(axis=1)).all()
        favourites = bits.argmin(axis=1)
        for j in range(len(right)):
            suitors = np.flatnonzero((favourites == j) & (bits.min(axis=1) < 999))
            if len(suitors):
                best = bits[suitors, j].min()
                winner = np.flatnonzero(partner == j)
                assert len(winner) == 1 and bits[winner[0], j] == best


@pytest.mark.parametrize("offset", [0.0, 0.7])
def test_a_wall_has_its_disparity_less_the_offset(offset: float) -> None:
    frontend = StereoFrontend(FrontendOptions(corners=400), disparity_offset=offset)
    frame = frontend.extract(*pair(12))
    assert len(frame.points) > 150
    assert (frame.points[:, 2] == 12 - offset).mean() > 0.95
    keyframe = frontend.make_keyframe(frame)
    assert len(keyframe.points) > 0.8 * len(frame.points)
    assert np.median(keyframe.points[:, 2]) == pytest.approx(12 - offset, abs=0.01)
    assert np.abs(np.median(keyframe.slopes, axis=0)).max() < 0.01
    assert (keyframe.strength > 0).mean() > 0.99


def test_a_keyframe_keeps_descriptors_and_points_together() -> None:
    frontend = StereoFrontend(FrontendOptions(corners=400))
    frame = frontend.extract(*pair(9))
    keyframe = frontend.make_keyframe(frame)
    place = {tuple(p[:2]): d for p, d in zip(frame.points, frame.descriptors, strict=True)}
    for point, descriptor in zip(keyframe.points, keyframe.descriptors, strict=True):
        np.testing.assert_array_equal(place[tuple(point[:2])], descriptor)
    assert len(keyframe.slopes) == len(keyframe.strength) == len(keyframe.points)


def test_points_at_infinity_make_no_keyframe() -> None:
    frontend = StereoFrontend(FrontendOptions(corners=400))
    frame = frontend.extract(*pair(0))
    assert len(frame.points) > 150
    assert len(frontend.make_keyframe(frame).points) < 0.05 * len(frame.points)


def test_rows_may_differ_by_what_rectification_leaves_and_no_more() -> None:
    frontend = StereoFrontend(FrontendOptions(corners=400))
    good = len(frontend.extract(*pair(12)).points)
    assert len(frontend.extract(*pair(12, rows=1)).points) > 0.8 * good
    assert len(frontend.extract(*pair(12, rows=6)).points) < 0.2 * good


def differing_pair(corner: float) -> tuple[Image, Image]:
    """A wall at 12 px in eyes that differ by a yaw and a decentering that cancel along x: by
    `corner` px of rows there, with opposite signs in neighbouring corners, and along y^2."""
    left = np.ascontiguousarray(IMAGE[10:230, 40:360])
    x, y = place = np.meshgrid(np.arange(320.0), np.arange(220.0))
    yaw = corner * 160 / 110
    for _ in range(5):  # where what is seen at the pixel is without the difference
        x_, y_ = (x - 160) / 160, (y - 110) / 160
        x, y = place[0] + yaw * y_**2, place[1] - yaw * x_ * y_
    places = (x + 52).astype(np.float32), (y + 10).astype(np.float32)
    right = cv2.remap(IMAGE, *places, cv2.INTER_LINEAR)
    return left, np.asarray(right, dtype=np.uint8)


@pytest.mark.parametrize("corner", [-2.0, 0.8, 2.0])
def test_eyes_that_differ_are_seen_through_after_one_keyframe(corner: float) -> None:
    """Sub-pixel disparities of slanted texture are wrong on the wrong row; 2 px off, most partners
    are in rows where nobody looks; and the difference along the rows is none of the wall's."""
    frontend = StereoFrontend(FrontendOptions(corners=400))
    pair = differing_pair(corner)
    first = frontend.extract(*pair)
    frontend.make_keyframe(first)
    frame = frontend.extract(*pair)
    places = np.array([[12, 0, 12], [332, 0, 12], [172, 110, 12], [332, 220, 12.0]])
    lower = corner * np.array([1.0, -1.0, 0.0, 1.0])
    np.testing.assert_allclose(frame.eyes.rows_at(places), lower, atol=0.15)
    assert len(frame.points) >= len(first.points)
    keyframe = frontend.make_keyframe(frame)
    assert np.std(keyframe.points[:, 2]) < 0.08
    assert np.mean(keyframe.points[:, 2]) == pytest.approx(12, abs=0.05)
    again = keyframe.points_by(first.eyes)[:, 2] - keyframe.points[:, 2]
    np.testing.assert_allclose(again, keyframe.eyes.disparities_at(keyframe.points))
    frontend.reset()
    np.testing.assert_array_equal(frontend.extract(*pair).points, first.points)


def test_eyes_as_good_as_their_calibration_are_left_alone() -> None:
    frontend = StereoFrontend(FrontendOptions(corners=400))
    for disparity in (12, 8, 16):
        frontend.make_keyframe(frontend.extract(*pair(disparity)))
    frame = frontend.extract(*pair(12))
    assert (frame.eyes.disparities_at(frame.points) == 0).all()


def test_after_reset_the_same_pair_gives_the_same_features() -> None:
    frontend = StereoFrontend(FrontendOptions(corners=900))
    dull = tuple((100 + image // 12).astype(np.uint8) for image in pair(7))
    first = frontend.extract(dull[0], dull[1])
    for _ in range(12):
        frontend.extract(*pair(12))
    assert len(frontend.extract(dull[0], dull[1]).points) != len(first.points), "cells had followed"
    frontend.reset()
    again = frontend.extract(dull[0], dull[1])
    np.testing.assert_array_equal(first.points, again.points)
    np.testing.assert_array_equal(first.descriptors, again.descriptors)


def test_darkness_has_no_features() -> None:
    frontend = StereoFrontend(FrontendOptions())
    black = np.zeros((220, 320), dtype=np.uint8)
    frame = frontend.extract(black, black)
    assert frame.points.shape == (0, 3) and frame.descriptors.shape == (0, 4)
    assert len(frontend.make_keyframe(frame).points) == 0


def test_grey_copies_what_it_is_given() -> None:
    image = np.random.default_rng(2).integers(0, 256, (8, 9, 1), dtype=np.uint8)
    copy = grey(image, "left")
    np.testing.assert_array_equal(copy, image[:, :, 0])
    assert not np.may_share_memory(copy, image)


def test_grey_of_equal_colours_is_that_grey() -> None:
    image = np.random.default_rng(3).integers(0, 256, (8, 9, 1), dtype=np.uint8)
    np.testing.assert_array_equal(grey(np.repeat(image, 3, axis=2), "left"), image[:, :, 0])
    red = np.zeros((4, 4, 3), dtype=np.uint8)
    red[..., 0] = 200
    assert grey(red, "left")[0, 0] == 60, "RGB, not BGR"


@pytest.mark.parametrize(
    "image",
    [np.zeros((8, 9), np.uint8), np.zeros((8, 9, 4), np.uint8), np.zeros((8, 9, 1), np.float32)],
)
def test_grey_refuses_other_shapes_and_types(image: NDArray[np.generic]) -> None:
    words = r"observation 'right' must be \(H, W, 1\) or \(H, W, 3\) uint8, got \(8, 9"
    with pytest.raises(ValueError, match=words):
        grey(image, "right")
