"""Active search: every point is sought in the ellipse where the filter expects it."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from grouser.estimators.monocular.appearance import SIZE, Appearance
from grouser.estimators.monocular.picture import Picture
from grouser.estimators.visual.alignment import align_plane
from grouser.estimators.visual.descriptor import (
    PATCH_RADIUS,
    Descriptors,
    describe,
    hamming,
    match_around,
)
from grouser.geometry import Array
from grouser.kernels import kernel_using


@dataclass(frozen=True, slots=True)
class SearchOptions:
    """How points are sought."""

    max_hamming: int = 64
    """Bits of 256 in which a point may differ from how it looked at its last sight."""
    ratio: float = 0.8
    """Best over second best Hamming distance must be below."""
    radius: tuple[float, float] = (3.0, 40.0)
    """Half the search window at least and at most, px in an image 320 px wide."""


@dataclass(frozen=True, slots=True)
class Sighting:
    """Where points were found."""

    seen: NDArray[np.int64]
    """(m,) indices of the points"""
    places: Array
    """(m, 2) px"""
    descriptors: Descriptors
    """(m, 4) how they look now"""


def search(
    picture: Picture,
    appearance: Appearance,
    expected: Array,
    covariance: Array,
    warps: Array,
    options: SearchOptions,
) -> Sighting:
    """Points found again: by descriptor among the corners, then by their patch to sub-pixels.

    A point that no corner matches is aligned from where it is expected, if that is near enough.
    Whatever was aligned must look as the point did.

    Args:
        expected: (n, 3) u, v [px], inverse depth in the current camera; NaN behind it.
        covariance: (n, 2, 2) of u and v, px^2.
        warps: (n, 2, 2) how the patches appear now.
    """
    height, width = picture.aligned.shape
    scale = width / 320
    partner = _match(picture, appearance, expected, covariance, options, scale)
    near = np.sqrt(covariance[:, 0, 0] + covariance[:, 1, 1]) < _NEAR
    guesses = np.where((partner >= 0)[:, None], picture.corners[partner], expected[:, :2])
    tried = np.flatnonzero(((partner >= 0) | near) & np.isfinite(expected[:, 0]))
    atlas = appearance.patches[tried].reshape(-1, SIZE)
    middles = np.column_stack(
        [np.full(len(tried), PATCH_RADIUS), PATCH_RADIUS + SIZE * np.arange(len(tried))]
    ).astype(np.float64)
    places = align_plane(
        atlas, picture.aligned, middles, guesses[tried].astype(np.float64), warps[tried], _LIMIT
    )[:, :2]
    pixels = np.rint(np.nan_to_num(places, nan=-1.0)).astype(np.int32)
    inside = (pixels >= PATCH_RADIUS).all(axis=1)
    inside &= (pixels < [width - PATCH_RADIUS, height - PATCH_RADIUS]).all(axis=1)
    tried, places, pixels = tried[inside], places[inside], pixels[inside]
    looks = describe(picture.described, pixels)
    alike = _distances(appearance.descriptors[tried], looks) < options.max_hamming
    return Sighting(tried[alike], places[alike], looks[alike])


_NEAR = 1.5  # px of sigma: what alignment reaches without a corner to start from
_LIMIT = 3.0  # px from the corner, or from where the point is expected


def _match(
    picture: Picture,
    appearance: Appearance,
    expected: Array,
    covariance: Array,
    options: SearchOptions,
    scale: float,
) -> NDArray[np.int64]:
    """(n,) index of the corner that each point is matched to, -1 without one."""
    # Matching knows disparities; here all are zero and known.
    flat, flat_covariance = expected.copy(), np.zeros((len(expected), 3, 3))
    flat[:, 2] = 0.0
    flat_covariance[:, :2, :2] = covariance
    corners = np.column_stack([picture.corners, np.zeros(len(picture.corners))])
    return np.asarray(
        match_around(
            flat,
            flat_covariance,
            appearance.descriptors,
            corners,
            picture.descriptors,
            options.radius[0] * scale,
            options.radius[1] * scale,
            options.max_hamming,
            options.ratio,
        )
    )


@kernel_using(hamming)
def _distances(a: Descriptors, b: Descriptors) -> NDArray[np.int64]:
    """(n,) bits in which descriptors (n, 4) differ pair by pair."""
    out = np.empty(a.shape[0], np.int64)
    for i in range(a.shape[0]):
        out[i] = hamming(a[i], b[i])
    return out
