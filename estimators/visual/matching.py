"""Matching over time (paper 1 III.A.2): features are sought where the prediction expects them."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from grouser.estimators.visual.alignment import PLANE_RADIUS, align_plane
from grouser.estimators.visual.bow import Bowed
from grouser.estimators.visual.descriptor import match_around
from grouser.estimators.visual.frontend import Keyframe, StereoFrame, align_disparities
from grouser.geometry import Array
from grouser.kernels import kernel


@dataclass(frozen=True, slots=True)
class MatchingOptions:
    """How features are sought and which of them are kept."""

    max_points: int = 64
    """Matched points that the estimation uses, spread over the image."""
    buckets: tuple[int, int] = (8, 6)
    """Columns and rows of the grid that spreads them."""
    radius: tuple[float, float] = (3.0, 40.0)
    """Half the search window at least and at most, px in an image 320 px wide."""


@dataclass(frozen=True, slots=True)
class PixelNoise:
    """Sigmas of a matched point.

    The keyframe's point is where its patch was cut, by definition, and has no error of place.
    """

    place: float = 0.08
    """px, of a patch found again that looks the same"""
    deformation: float = 0.4
    """px more per unit by which the patch is stretched or sheared: detail comes and goes with it"""
    disparity: float = 0.1
    """px"""
    grey: float = 3.0
    """Grey levels by which two looks at the same patch differ: little texture, or texture of one
    direction, makes pixels of that. Without it a skyline's points are believed along the skyline"""

    def expected(self) -> Array:
        """(6,) variances of u, v, d in the keyframe and now, of a patch that looks the same."""
        return np.array([_CUT, _CUT, self.disparity, self.place, self.place, self.disparity]) ** 2

    def of_patches(self, warps: Array, spreads: Array) -> Array:
        """(n, 6) the same of patches under warps (n, 2, 2), by how little texture held them: the
        variances (n, 2) of u and v per squared grey level.
        """
        stretch = np.linalg.norm(warps - np.eye(2), axis=(1, 2))
        variances = np.tile(self.expected(), (len(warps), 1))
        variances[:, 3:5] += (self.deformation * stretch[:, None]) ** 2
        variances[:, 3:5] += self.grey**2 * spreads
        return variances


_CUT = 1e-3  # px


@dataclass(frozen=True, slots=True)
class Prediction:
    """Where the reference frame's points are expected (`motion.predict_points`)."""

    points: Array
    """(n, 3) u, v, d [px]; NaN behind the camera"""
    covariance: Array
    """(n, 3, 3)"""
    by_point: Array
    """(n, 3, 3) derivative by the reference point"""


@dataclass(frozen=True, slots=True)
class Matches:
    """The same points in the reference frame and in the current one, aligned to sub-pixels."""

    reference: Array
    """(n, 3) u, v, d [px]"""
    current: Array
    """(n, 3)"""
    noise: Array
    """(n, 6) variances of u, v, d in the reference and in the current frame [px^2]"""
    candidates: int
    """How many features matched before the choice."""
    shares: Array | None = None
    """(n,) what share of its pixels each has to itself (`own_shares`); None where all of them."""
    bowed: Bowed | None = None
    """How the disparities hang on how the eyes differ; None where they do not."""


def match_frames(
    reference: Keyframe,
    current: StereoFrame,
    prediction: Prediction,
    options: MatchingOptions,
    noise: PixelNoise,
    *,
    disparity_offset: float,
) -> Matches:
    """Features of the reference frame found again around their predictions."""
    height, width = current.left.shape
    scale = width / 320
    partner = match_around(
        prediction.points,
        prediction.covariance,
        reference.descriptors,
        current.points,
        current.descriptors,
        options.radius[0] * scale,
        options.radius[1] * scale,
        current.likeness.max_distance,
        current.likeness.ratio,
    )
    found = np.flatnonzero(partner >= 0)
    candidates = len(found)
    now = current.points[partner[found]]
    # Near points tell of the translation, distinct corners align well: near first, within buckets.
    score = now[:, 2] * np.sqrt(reference.strength[found] / reference.strength.max(initial=1.0))
    chosen = spread(now, score, options, width, height)
    found, now = found[chosen], now[chosen]
    warps = surface_warp(prediction.by_point[found], reference.slopes[found])
    place = align_plane(
        reference.left, current.left, reference.points[found], now, warps, _ALIGNMENT_LIMIT
    )
    settled = np.flatnonzero(np.isfinite(place[:, 0]))
    points = np.column_stack([place[settled, :2], now[settled, 2]])
    disparity = align_disparities(current, points, disparity_offset)[0][:, 0]
    good = np.nan_to_num(disparity) > 0
    aligned = np.column_stack([points[good, :2], disparity[good]])
    kept = settled[good]
    eyes, before = current.eyes, reference.points_by(current.eyes)[found[kept]]
    return Matches(
        before,
        aligned,
        noise.of_patches(warps[kept], place[kept, 2:]),
        candidates,
        own_shares(aligned, PATCH_REACH),
        Bowed(eyes.bowed_at(before), eyes.bowed_at(aligned), eyes.bow),
    )


@kernel
def own_shares(points: Array, reach: float) -> Array:
    """(n,) what share of its pixels a point (n, >= 2) has to itself: 1 alone, half of two at one
    place.

    Patches that overlap err alike, and two such points are no two witnesses.

    Args:
        reach: px from a point to the next one that shares no pixel with it.
    """
    n = points.shape[0]
    shares = np.empty(n)
    for i in range(n):
        together = 0.0
        for j in range(n):
            across = 1.0 - abs(points[j, 0] - points[i, 0]) / reach
            down = 1.0 - abs(points[j, 1] - points[i, 1]) / reach
            if across > 0.0 and down > 0.0:
                together += across * down
        shares[i] = 1.0 / together
    return shares


PATCH_REACH = 2 * PLANE_RADIUS + 3.0
"""px: a patch, and what the blur before alignment (`frontend`) brings into it"""


def surface_warp(by_point: Array, slopes: Array) -> Array:
    """(n, 2, 2) how offsets from a point in the reference image appear in the current one.

    Along the surface the disparity changes with the slopes (n, 2): d(u', v') / d(u, v) is the
    derivative by the pixel plus that by the disparity times the slope.
    """
    return np.asarray(by_point[:, :2, :2] + by_point[:, :2, 2:] * slopes[:, None, :])


_ALIGNMENT_LIMIT = 2.5  # px from the corner that the descriptor found


def spread(
    points: Array, score: Array, options: MatchingOptions, width: int, height: int
) -> NDArray[np.int64]:
    """Indices of at most max_points points: the best of every bucket, then the second best..."""
    columns, rows = options.buckets
    bucket = (points[:, 0] * columns / width).astype(int) + columns * (
        points[:, 1] * rows / height
    ).astype(int)
    order = np.lexsort((-score, bucket))
    sorted_bucket = bucket[order]
    first = np.searchsorted(sorted_bucket, sorted_bucket)
    rank = np.arange(len(order)) - first
    return np.sort(order[np.lexsort((-score[order], rank))[: options.max_points]])
