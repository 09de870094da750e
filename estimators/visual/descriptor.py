"""256-bit binary descriptors of corners (BRIEF), and the matching of descriptors.

BRIEF (Calonder et al. 2010) compares 256 pairs of smoothed pixels around a corner. It is not made
invariant to rotation: a ground robot's camera does not roll by more than it stands.
"""

from typing import Any

import cv2
import numpy as np
from numba.extending import overload
from numpy.typing import NDArray

from grouser.geometry import Array
from grouser.kernels import kernel

Image = NDArray[np.uint8]
BinaryDescriptors = NDArray[np.uint64]
"""(n, 4): 256 bits each"""
Descriptors = BinaryDescriptors | NDArray[np.uint8]
"""Binary ones, or vectors of small whole numbers (SIFT)"""

PATCH_RADIUS = 13
"""Pixels around a corner that its descriptor reads."""
BITS = 256
GATE_2 = 9.21
"""chi-square of 2 degrees of freedom at 99 %: the search ellipse."""
_UNLIKE = 1 << 40


def _pattern() -> NDArray[np.int64]:
    """(256, 4) x, y of the two pixels of every comparison, normal about the corner."""
    rng = np.random.default_rng(2010)
    offsets = rng.normal(0.0, (2 * PATCH_RADIUS + 1) / 5, (BITS, 4))
    return np.clip(np.rint(offsets), -PATCH_RADIUS, PATCH_RADIUS).astype(np.int64)


_PATTERN = _pattern()


def smooth(image: Image, sigma: float) -> Image:
    """The image under a Gaussian of sigma [px]."""
    return np.asarray(cv2.GaussianBlur(image, (0, 0), sigma), dtype=np.uint8)


def describe(smoothed: Image, corners: NDArray[np.int32]) -> BinaryDescriptors:
    """Descriptors (n, 4) of corners at least PATCH_RADIUS from the edge of a smoothed image."""
    stride = smoothed.shape[1]
    # From a patch's first pixel all offsets are positive, and unsigned indices need no check.
    middle = PATCH_RADIUS * (stride + 1)
    place = corners[:, 1].astype(np.int64) * stride + corners[:, 0] - middle
    first = _PATTERN[:, 1] * stride + _PATTERN[:, 0] + middle
    second = _PATTERN[:, 3] * stride + _PATTERN[:, 2] + middle
    indices = (a.astype(np.uint64) for a in (place, first, second))
    return np.asarray(_describe(smoothed.ravel(), *indices))


@kernel
def _describe(
    pixels: Image, place: NDArray[np.uint64], first: NDArray[np.uint64], second: NDArray[np.uint64]
) -> BinaryDescriptors:
    out = np.zeros((place.shape[0], 4), np.uint64)
    for i in range(place.shape[0]):
        for word in range(4):
            bits = np.uint64(0)
            for k in range(64 * word, 64 * word + 64):
                darker = pixels[place[i] + first[k]] < pixels[place[i] + second[k]]
                bits = (bits << np.uint64(1)) | np.uint64(darker)
            out[i, word] = bits
    return out


@kernel
def hamming(a: BinaryDescriptors, b: BinaryDescriptors) -> int:
    """Bits in which two descriptors (4,) differ."""
    total = np.uint64(0)
    for word in range(4):
        x = a[word] ^ b[word]
        x = x - ((x >> np.uint64(1)) & np.uint64(0x5555555555555555))
        x = (x & np.uint64(0x3333333333333333)) + (
            (x >> np.uint64(2)) & np.uint64(0x3333333333333333)
        )
        x = (x + (x >> np.uint64(4))) & np.uint64(0x0F0F0F0F0F0F0F0F)
        total += (x * np.uint64(0x0101010101010101)) >> np.uint64(56)
    return int(total)


@kernel
def squared_length(a: NDArray[np.uint8], b: NDArray[np.uint8]) -> int:
    """Of the difference of two descriptors (k,)."""
    total = 0
    for i in range(a.shape[0]):
        difference = int(a[i]) - int(b[i])
        total += difference * difference
    return total


def difference(a: Descriptors, b: Descriptors) -> int:
    """How far two descriptors differ, in kernels: bits of binary ones, else their squared length.

    Raises:
        NotImplementedError: called outside a kernel.
    """
    raise NotImplementedError("difference() is for kernels: call hamming or squared_length")


def _difference_of(a: Any, b: Any) -> Any:
    """What numba compiles `difference` to, by the descriptors' type."""
    if a.dtype.bitwidth == 64:
        return lambda a, b: hamming(a, b)
    return lambda a, b: squared_length(a, b)


overload(difference, strict=False)(_difference_of)


@kernel
def match_rows(
    left: NDArray[np.int32],
    left_descriptors: Descriptors,
    right: NDArray[np.int32],
    right_descriptors: Descriptors,
    height: int,
    row_tolerance: int,
    max_disparity: int,
    max_distance: int,
    ratio: float,
) -> NDArray[np.int64]:
    """Index (n,) of every left corner's partner in the right image, -1 where there is none.

    Corners (n, 2) are ordered by row. Partners lie in nearby rows, within the disparity range,
    and are each other's best; `ratio` is how good against the second best.
    """
    start = np.zeros(height + 1, np.int64)
    for j in range(right.shape[0]):
        start[right[j, 1] + 1] += 1
    for y in range(height):
        start[y + 1] += start[y]
    partner = np.full(left.shape[0], -1, np.int64)
    suitor = np.full(right.shape[0], -1, np.int64)
    distance = np.full(right.shape[0], max_distance, np.int64)
    for i in range(left.shape[0]):
        first = start[max(left[i, 1] - row_tolerance, 0)]
        last = start[min(left[i, 1] + row_tolerance + 1, height)]
        best, second, chosen = max_distance, _UNLIKE, -1
        for j in range(first, last):
            disparity = left[i, 0] - right[j, 0]
            if 0 <= disparity <= max_disparity:
                differ = difference(left_descriptors[i], right_descriptors[j])
                if differ < best:
                    if chosen >= 0:
                        second = best
                    best, chosen = differ, j
                elif differ < second:
                    second = differ
        if chosen >= 0 and best <= ratio * second and best < distance[chosen]:
            if suitor[chosen] >= 0:
                partner[suitor[chosen]] = -1
            partner[i], suitor[chosen], distance[chosen] = chosen, i, best
    return partner


@kernel
def match_around(
    predicted: Array,
    covariance: Array,
    descriptors: Descriptors,
    points: Array,
    point_descriptors: Descriptors,
    least: float,
    most: float,
    max_distance: int,
    ratio: float,
) -> NDArray[np.int64]:
    """Index (n,) of every reference feature's match among the current points, -1 without one."""
    n, m = predicted.shape[0], points.shape[0]
    partner = np.full(n, -1, np.int64)
    suitor = np.full(m, -1, np.int64)
    distance = np.full(m, max_distance, np.int64)
    for i in range(n):
        if not np.isfinite(predicted[i, 0]):
            continue
        S = covariance[i]
        half_u = min(max(3 * np.sqrt(S[0, 0]), least), most)
        half_v = min(max(3 * np.sqrt(S[1, 1]), least), most)
        half_d = max(3 * np.sqrt(S[2, 2]), 1.5)
        # The ellipse never shrinks below the corner detector's own scatter.
        floor = (least / 3) ** 2
        a, b, c = S[0, 0] + floor, S[0, 1], S[1, 1] + floor
        determinant = a * c - b * b
        best, second, chosen = max_distance, _UNLIKE, -1
        for j in range(m):
            dv = points[j, 1] - predicted[i, 1]
            if abs(dv) > half_v:
                continue
            du = points[j, 0] - predicted[i, 0]
            if abs(du) > half_u or abs(points[j, 2] - predicted[i, 2]) > half_d:
                continue
            if (c * du * du - 2 * b * du * dv + a * dv * dv) > GATE_2 * determinant:
                continue
            differ = difference(descriptors[i], point_descriptors[j])
            if differ < best:
                if chosen >= 0:
                    second = best
                best, chosen = differ, j
            elif differ < second:
                second = differ
        if chosen < 0 or best > ratio * second or best >= distance[chosen]:
            continue
        if suitor[chosen] >= 0:
            partner[suitor[chosen]] = -1
        partner[i], suitor[chosen], distance[chosen] = chosen, i, best
    return partner
