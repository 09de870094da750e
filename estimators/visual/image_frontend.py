"""The front end for images: stereo features, matched over time where the prediction says."""

from dataclasses import replace

import numpy as np

from grouser.estimators.base import Observation
from grouser.estimators.visual.base import Frontend
from grouser.estimators.visual.descriptor import Image
from grouser.estimators.visual.frontend import (
    FrontendOptions,
    Keyframe,
    StereoFrame,
    StereoFrontend,
    grey_of,
)
from grouser.estimators.visual.matching import (
    Matches,
    MatchingOptions,
    PixelNoise,
    Prediction,
    match_frames,
)
from grouser.estimators.visual.structure import OffsetEvidence
from grouser.geometry import Array
from grouser.rig import StereoCamera


class ImageFrontend(Frontend[StereoFrame, Keyframe]):
    """Reads `left` and `right` of an observation, rectified pairs as the camera is calibrated."""

    def __init__(
        self,
        camera: StereoCamera,
        *,
        options: FrontendOptions,
        matching: MatchingOptions,
        noise: PixelNoise,
    ) -> None:
        self._camera = camera
        self._stereo = StereoFrontend(
            options, disparity_offset=camera.disparity_offset, focal=2 * camera.fx / camera.width
        )
        self._matching = matching
        self._noise = noise
        self._last: tuple[Image, Image] | None = None

    @property
    def expected_noise(self) -> Array:
        return self._noise.expected()

    def reset(self) -> None:
        self._stereo.reset()
        self._last = None

    def extract(self, observation: Observation) -> StereoFrame:
        left, right = (grey_of(observation, eye, self._camera) for eye in ("left", "right"))
        repeated = self._last is not None and _same(self._last, (left, right))
        self._last = left, right
        frame = self._stereo.extract(left, right)
        # Sensors are noisy: the same bits again are a frame that got stuck, and tell nothing.
        return _nothing_of(frame) if repeated and not _at_rest(observation) else frame

    def make_keyframe(self, frame: StereoFrame) -> Keyframe:
        return self._stereo.make_keyframe(frame)

    def match(self, keyframe: Keyframe, frame: StereoFrame, prediction: Prediction) -> Matches:
        return match_frames(
            keyframe,
            frame,
            prediction,
            self._matching,
            self._noise,
            disparity_offset=self._camera.disparity_offset,
        )

    def learn(self, matches: Matches, evidence: OffsetEvidence) -> None:
        if matches.bowed is not None:
            self._stereo.learn_bow(evidence, matches.bowed.bow)


def _same(before: tuple[Image, Image], now: tuple[Image, Image]) -> bool:
    return all(np.array_equal(a, b) for a, b in zip(before, now, strict=True))


def _at_rest(observation: Observation) -> bool:
    """Whether tracks say that nothing moves: without any noise, images then are the same."""
    return "tracks" in observation and not np.any(observation["tracks"])


def _nothing_of(frame: StereoFrame) -> StereoFrame:
    """The frame without a point."""
    return replace(frame, points=frame.points[:0], descriptors=frame.descriptors[:0])
