"""A front end for points that somebody else tracked: positions and identities, no images."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from grouser.estimators.base import Observation
from grouser.estimators.visual.base import Frontend
from grouser.estimators.visual.matching import Matches, MatchingOptions, Prediction, spread
from grouser.estimators.visual.structure import OffsetEvidence
from grouser.geometry import Array, transform
from grouser.rig import StereoCamera


def middle_eye(camera: StereoCamera) -> StereoCamera:
    """The camera half-way between the two eyes, for points measured in each of them alone.

    With independent errors of u in either eye, the left eye's u and the disparity are correlated;
    the mean of both eyes' u and the disparity are not, and the noise stays one variance a
    coordinate (SPEC 1.0 has it for the left eye).
    """
    to_middle = transform(np.eye(3), [camera.baseline / 2, 0.0, 0.0])
    return replace(camera, T_base_camera=camera.T_base_camera @ to_middle)


def eyes_noise(sigma_px: float) -> Array:
    """(6,) variances of u, v, d in two frames, seen from the middle, of the eyes' noise [px]."""
    return sigma_px**2 * np.array([0.5, 1.0, 2.0] * 2)


@dataclass(frozen=True, slots=True)
class PointFrame:
    """Points seen at one moment."""

    points: Array
    """(n, 3) u, v, d [px]"""
    identities: NDArray[np.int64]
    """(n,)"""
    mismatched: Array
    """(n, 3) what each point is taken for when it is sought in this frame"""


class PointFrontend(Frontend[PointFrame, PointFrame]):
    """Reads `points` (n, 3) u, v, d [px] of the estimator's camera and `identities` (n,).

    Where there is `mismatched` (n, 3), a search for a point of an earlier frame finds that instead:
    a wrong match, which leaves the point itself unharmed when this frame is a keyframe.
    """

    def __init__(self, camera: StereoCamera, *, noise: Array, matching: MatchingOptions) -> None:
        """noise: (6,) variances of u, v, d [px^2] in the keyframe and in the frame."""
        self._camera = camera
        self._noise = noise
        self._matching = matching

    @property
    def expected_noise(self) -> Array:
        return self._noise

    def reset(self) -> None:
        """It has no memory."""

    def extract(self, observation: Observation) -> PointFrame:
        points = np.array(observation["points"], dtype=np.float64)
        mismatched = np.array(observation.get("mismatched", points), dtype=np.float64)
        return PointFrame(points, np.array(observation["identities"]), mismatched)

    def make_keyframe(self, frame: PointFrame) -> PointFrame:
        return frame

    def match(self, keyframe: PointFrame, frame: PointFrame, prediction: Prediction) -> Matches:
        _, before, now = np.intersect1d(
            keyframe.identities, frame.identities, assume_unique=True, return_indices=True
        )
        found = frame.mismatched[now]
        # Near points tell of the translation: near first, within buckets, as with images.
        score, size = keyframe.points[before, 2], (self._camera.width, self._camera.height)
        chosen = spread(keyframe.points[before], score, self._matching, *size)
        noise = np.tile(self._noise, (len(chosen), 1))
        return Matches(keyframe.points[before[chosen]], found[chosen], noise, len(before))

    def learn(self, matches: Matches, evidence: OffsetEvidence) -> None:
        """It is told what there is."""
