"""Corners: as many as wanted, all over the image, in the order that the matching needs."""

import numpy as np
import pytest

from grouser.estimators.visual.corners import CornerDetector, strength
from grouser.estimators.visual.descriptor import PATCH_RADIUS, Image
from grouser.geometry import Array
from tests.estimators.visual.pictures import blocks

IMAGE = blocks(np.random.default_rng(0))


def settled(detector: CornerDetector, image: Image) -> int:
    """Corners found once the thresholds follow the image no longer."""
    for _ in range(20):
        corners = detector.detect(image)
        if detector.adapt(corners, (image.shape[0], image.shape[1])):
            break
    return len(detector.detect(image))


@pytest.mark.parametrize("wanted", [200, 400, 800])
def test_the_number_of_corners_comes_near_the_wanted(wanted: int) -> None:
    found = settled(CornerDetector(wanted), IMAGE)
    assert 0.65 * wanted < found < 1.35 * wanted


def test_a_dull_half_of_the_image_has_corners_of_its_own() -> None:
    """One threshold for the whole image would leave them out."""
    image = IMAGE.copy()
    image[120:] = 100 + image[120:] // 6
    detector = CornerDetector(400)
    settled(detector, image)
    rows = detector.detect(image)[:, 1]
    assert 0.25 < (rows > 124).mean() < 0.75


def test_corners_are_ordered_by_row_and_leave_room_for_their_descriptor() -> None:
    corners = CornerDetector(400).detect(IMAGE)
    assert corners.dtype == np.int32 and corners.flags.c_contiguous
    order = np.lexsort((corners[:, 0], corners[:, 1]))
    np.testing.assert_array_equal(order, np.arange(len(corners)))
    assert corners.min() >= PATCH_RADIUS
    assert (corners < np.array([320, 240]) - PATCH_RADIUS).all()
    assert len(np.unique(corners, axis=0)) == len(corners), "cells must not overlap"


def test_thresholds_follow_and_reset_forgets_them() -> None:
    detector = CornerDetector(400)
    first = detector.detect(IMAGE)
    settled(detector, IMAGE)
    assert len(detector.detect(IMAGE)) != len(first)
    detector.reset()
    np.testing.assert_array_equal(detector.detect(IMAGE), first)


def test_an_image_without_corners_is_borne() -> None:
    detector, black = CornerDetector(400), np.zeros((240, 320), dtype=np.uint8)
    corners = detector.detect(black)
    assert corners.shape == (0, 2)
    for _ in range(12):
        detector.adapt(corners, (240, 320))
    assert detector.adapt(corners, (240, 320)), "the lowest threshold is the end of it"


def test_strength_is_the_smaller_eigenvalue_of_the_second_moments() -> None:
    points = CornerDetector(100).detect(IMAGE)[:20].astype(float)
    padded = IMAGE.astype(float)
    gx = np.zeros_like(padded)
    gy = np.zeros_like(padded)
    gx[:, 1:-1] = padded[:, 2:] - padded[:, :-2]
    gy[1:-1] = padded[2:] - padded[:-2]

    def smaller(u: int, v: int) -> float:
        window = np.s_[v - 3 : v + 4, u - 3 : u + 4]
        g: Array = np.stack([gx[window].ravel(), gy[window].ravel()])
        return float(np.linalg.eigvalsh(g @ g.T)[0])

    expected = [smaller(int(u), int(v)) for u, v in points]
    np.testing.assert_allclose(strength(IMAGE, points), expected, rtol=1e-9, atol=1e-6)


def test_an_edge_has_no_strength_and_a_corner_has() -> None:
    image = np.full((60, 60), 40, dtype=np.uint8)
    image[30:, 30:] = 200
    corner, edge, flat = strength(image, np.array([[30.0, 30.0], [30.0, 45.0], [15.0, 15.0]]))
    assert corner > 1e4 and edge == 0.0 and flat == 0.0
