"""Binary descriptors: bits of comparisons, unmoved by light, told apart by Hamming distance."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from grouser.estimators.visual.descriptor import (
    BITS,
    PATCH_RADIUS,
    Descriptors,
    describe,
    hamming,
    smooth,
)
from tests.estimators.visual.pictures import blocks, plain, waves

words = st.lists(st.integers(0, 2**64 - 1), min_size=4, max_size=4).map(
    lambda bits: np.array(bits, dtype=np.uint64)
)


@given(words, words)
def test_hamming_counts_the_bits_that_differ(a: Descriptors, b: Descriptors) -> None:
    expected = int(np.unpackbits((a ^ b).view(np.uint8)).sum())
    assert hamming(a, b) == expected == hamming(b, a)
    assert hamming(a, a) == 0 and hamming(a, ~a) == BITS


def corners(n: int = 60) -> NDArray[np.int32]:
    rng = np.random.default_rng(1)
    low, high = PATCH_RADIUS, np.array([320, 240]) - PATCH_RADIUS
    return rng.integers(low, high, (n, 2)).astype(np.int32)


IMAGE = smooth(blocks(np.random.default_rng(0)), 2.0)


def test_added_brightness_changes_no_bit() -> None:
    low = (IMAGE // 2).astype(np.uint8)
    np.testing.assert_array_equal(describe(low, corners()), describe(low + 60, corners()))


def test_a_shifted_image_gives_the_same_descriptors_elsewhere() -> None:
    shifted = np.roll(IMAGE, (-5, 7), axis=(0, 1))
    inner = corners()
    inner = inner[(inner[:, 0] < 290) & (inner[:, 1] > 30)]
    np.testing.assert_array_equal(
        describe(IMAGE, inner), describe(shifted, (inner + [7, -5]).astype(np.int32))
    )


def test_every_bit_is_a_comparison_of_two_pixels_of_the_patch() -> None:
    """A flat patch sets no bit, a patch and its negative share none, pixels outside do nothing."""
    flat = np.full((60, 60), 77, dtype=np.uint8)
    middle = np.array([[30, 30]], dtype=np.int32)
    assert not describe(flat, middle).any()
    patch = np.random.default_rng(2).permutation(3600).reshape(60, 60)
    distinct = (patch // 15).astype(np.uint8)
    positive, negative = describe(distinct, middle)[0], describe(255 - distinct, middle)[0]
    assert not (positive & negative).any()
    outside = distinct.copy()
    inside = slice(30 - PATCH_RADIUS, 30 + PATCH_RADIUS + 1)
    outside[:] = 0
    outside[inside, inside] = distinct[inside, inside]
    assert hamming(positive, describe(outside, middle)[0]) == 0


def test_noise_flips_few_bits_and_another_place_half_of_them() -> None:
    rng, image = np.random.default_rng(3), blocks(np.random.default_rng(4))
    noisy = np.clip(image + rng.normal(0, 4, image.shape), 0, 255).astype(np.uint8)
    places = corners()
    a, b = describe(smooth(image, 2.0), places), describe(smooth(noisy, 2.0), places)
    same = [hamming(x, y) for x, y in zip(a, b, strict=True)]
    others = [hamming(x, y) for x, y in zip(a, np.roll(a, 1, axis=0), strict=True)]
    assert max(same) < 64 < np.median(others)
    assert np.mean(others) > 5 * np.mean(same)


def test_smoothing_keeps_the_mean_and_removes_noise() -> None:
    rng = np.random.default_rng(5)
    clean = plain(waves(rng, shortest=30.0))
    noisy = np.clip(clean + rng.normal(0, 10, clean.shape), 0, 255).astype(np.uint8)
    smoothed = smooth(noisy, 2.0).astype(float)
    assert abs(smoothed.mean() - noisy.mean()) < 0.6
    assert np.std(smoothed - smooth(clean, 2.0)) < 2.0
