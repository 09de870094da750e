"""Binocular stereo processing (paper 1 III.A.1): corners, descriptors, matches between the eyes."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from grouser.estimators.base import Observation
from grouser.estimators.visual.bow import Bow
from grouser.estimators.visual.corners import strength
from grouser.estimators.visual.descriptor import Descriptors, Image, match_rows, smooth
from grouser.estimators.visual.eye_difference import EyeDifference, EyeDifferenceFit
from grouser.estimators.visual.fast import FastFeatures
from grouser.estimators.visual.features import FeatureExtractor, Likeness
from grouser.estimators.visual.row_alignment import align_rows
from grouser.estimators.visual.sift import SiftFeatures
from grouser.estimators.visual.structure import OffsetEvidence
from grouser.geometry import Array
from grouser.rig import StereoCamera

FEATURES: dict[str, Callable[[int], FeatureExtractor]] = {
    "fast": FastFeatures,
    "sift": SiftFeatures,
}


def grey(image: NDArray[Any], name: str) -> Image:
    """A copy (H, W) of an observed image (H, W, 1) or (H, W, 3), uint8.

    Raises:
        ValueError: another shape or type.
    """
    if image.ndim != 3 or image.shape[2] not in (1, 3) or image.dtype != np.uint8:
        raise ValueError(
            f"observation {name!r} must be (H, W, 1) or (H, W, 3) uint8, "
            f"got {image.shape} {image.dtype}"
        )
    if image.shape[2] == 3:
        return np.asarray(cv2.cvtColor(image, cv2.COLOR_RGB2GRAY), dtype=np.uint8)
    return image[:, :, 0].copy()


def grey_of(observation: Observation, eye: str, camera: StereoCamera) -> Image:
    """A copy (H, W) of what an eye sees.

    Raises:
        ValueError: it is no image, or of another size than the camera is calibrated for.
    """
    image = grey(observation[eye], eye)
    # Of another size, calibration and pixels disagree, and kernels would leave the image.
    expected = (camera.height, camera.width)
    if image.shape != expected:
        raise ValueError(
            f"observation {eye!r} is {image.shape[1]} x {image.shape[0]} px, but rig.stereo is "
            f"calibrated for {expected[1]} x {expected[0]}: make the environment with images "
            "of that size, and estimate before whatever resizes them"
        )
    return image


@dataclass(frozen=True, slots=True)
class FrontendOptions:
    """What the front end aims for."""

    corners: int = 900
    """Corners an image, about; the detector's thresholds follow."""
    features: str = "fast"
    """What kind of features, one of `FEATURES`."""
    row_tolerance: int = 1
    """How far a pair's rows may differ, px: what rectification leaves."""
    max_disparity: float = 0.4
    """Of the image's width."""


@dataclass(frozen=True, slots=True)
class StereoFrame:
    """One stereo pair's features, and the images, a little smoothed, that alignments read."""

    left: Image
    right: Image
    points: Array
    """(n, 3) u, v, d [px], to the pixel"""
    descriptors: Descriptors
    """(n, k)"""
    likeness: Likeness
    """How the descriptors are compared."""
    eyes: EyeDifference
    """How the eyes differ."""


@dataclass(frozen=True, slots=True)
class Keyframe:
    """The features that later frames are matched to."""

    left: Image
    points: Array
    """(n, 3) u, v, d [px]; u and v are whole pixels, d is sub-pixel, calibrated, positive."""
    slopes: Array
    """(n, 2) how the disparity changes along x and y [px / px]: the surface around the point"""
    descriptors: Descriptors
    """(n, k)"""
    strength: Array
    """(n,) how well the corner is defined"""
    eyes: EyeDifference
    """How the eyes were taken to differ."""

    def points_by(self, eyes: EyeDifference) -> Array:
        """(n, 3) the points as seen by eyes that are known better by now."""
        points = self.points.copy()
        points[:, 2] += self.eyes.disparities_at(points) - eyes.disparities_at(points)
        return points


class StereoFrontend:
    """Turns stereo pairs into matched features; it remembers what its extractor does, and how the
    eyes differ."""

    def __init__(
        self, options: FrontendOptions, *, disparity_offset: float = 0.0, focal: float = 1.0
    ) -> None:
        """
        Args:
            disparity_offset: measured minus true disparity, px.
            focal: length, half widths of the image.
        """
        self._focal = focal
        self._options = options
        self._offset = disparity_offset
        self._extractor = FEATURES[options.features](options.corners)
        self._eyes = EyeDifferenceFit(self._focal)

    def reset(self) -> None:
        """Forget what earlier images led to."""
        self._extractor.reset()
        self._eyes = EyeDifferenceFit(self._focal)

    def extract(self, left: Image, right: Image) -> StereoFrame:
        """Features of a rectified pair (H, W) uint8, matched to the pixel."""
        options, likeness = self._options, self._extractor.likeness
        features, others = self._extractor.extract(left, right)
        left, right = smooth(left, _ALIGNMENT_BLUR), smooth(right, _ALIGNMENT_BLUR)
        eyes = self._eyes.difference(left.shape)
        sought = features.places.copy()
        at_infinity = np.column_stack([sought, np.zeros(len(sought))])
        sought[:, 1] += np.rint(eyes.rows_at(at_infinity)).astype(np.int32)
        partner = match_rows(
            sought,
            features.descriptors,
            others.places,
            others.descriptors,
            left.shape[0],
            options.row_tolerance,
            int(options.max_disparity * left.shape[1]),
            likeness.max_distance,
            likeness.row_ratio,
        )
        kept = np.flatnonzero(partner >= 0)
        points = np.empty((len(kept), 3))
        points[:, :2] = features.places[kept]
        points[:, 2] = features.places[kept, 0] - others.places[partner[kept], 0]
        points[:, 2] -= self._offset + eyes.disparities_at(points)
        return StereoFrame(left, right, points, features.descriptors[kept], likeness, eyes)

    def make_keyframe(self, frame: StereoFrame) -> Keyframe:
        """The frame with its disparities to a fraction of a pixel; what does not align is left."""
        aligned, eyes = self._align(frame)
        points = np.column_stack([frame.points[:, :2], aligned[:, 0]])
        good = np.nan_to_num(points[:, 2]) > _MIN_DISPARITY
        return Keyframe(
            frame.left,
            points[good],
            aligned[good, 1:],
            frame.descriptors[good],
            strength(frame.left, points[good]),
            eyes,
        )

    def learn_bow(self, evidence: OffsetEvidence, known: Bow) -> None:
        """What points tell of the eyes that matched with a bow taken out as it was known."""
        if evidence.bow is not None:
            self._eyes.bow.learn(evidence.bow, known)

    def _align(self, frame: StereoFrame) -> tuple[Array, EyeDifference]:
        """Disparities and slopes (n, 3) of a frame's points, from which the eyes' difference is
        learnt, and that which was taken out; of the first frame once more, when it is known."""
        was_empty = self._eyes.empty
        aligned = self._align_once(frame)
        if was_empty and not self._eyes.empty:
            frame = replace(frame, eyes=self._eyes.difference(frame.left.shape))
            aligned = self._align_once(frame)
        return aligned, frame.eyes

    def _align_once(self, frame: StereoFrame) -> Array:
        aligned, off = align_disparities(frame, frame.points, self._offset)
        lower = frame.eyes.rows_at(frame.points) + off[:, 0]
        self._eyes.learn(lower, off[:, 1], frame.points, frame.eyes)
        return aligned


def align_disparities(frame: StereoFrame, points: Array, offset: float) -> tuple[Array, Array]:
    """Calibrated sub-pixel disparities and their slopes (n, 3) at points (n, 3) u, v, d [px], and
    the rows' errors (n, 2) of `align_rows`.

    offset: measured minus true disparity, px. NaN where a patch does not align.
    """
    measured, lower = points.copy(), frame.eyes.rows_at(points)
    more = offset + frame.eyes.disparities_at(points)
    measured[:, 2] += more
    aligned, rows = align_rows(frame.left, frame.right, measured, lower, _ROW_LIMIT)
    aligned[:, 0] -= more
    return aligned, rows


_ROW_LIMIT = 1.5  # px of disparity from what the descriptors found
# px. Interpolation misreads sharper images, and alignment then overshoots half-way between pixels.
_ALIGNMENT_BLUR = 1.0
_MIN_DISPARITY = 0.5  # px: farther points say nothing of the translation that pixels could hold
