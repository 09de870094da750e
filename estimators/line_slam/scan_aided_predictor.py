"""A predictor whose increments are made surer by laying each lidar scan over the one before."""

import numpy as np

from grouser.estimators.base import Observation
from grouser.estimators.line_slam.scan_stream import ScanStream
from grouser.estimators.scan_matching.matcher import ScanMatch, ScanMatcher
from grouser.estimators.scan_matching.reference import make_reference
from grouser.estimators.scan_matching.surface import Surface, surface_of
from grouser.estimators.visual.prediction import Increment, MotionPredictor
from grouser.geometry import Array, wrap
from grouser.rig import Rig


class ScanAidedPredictor(MotionPredictor):
    """Another predictor's increments, and what two scans tell of the motion between them.

    Odometry that errs by degrees a metre lets a wrong line turn the heading as far, and nothing
    says so; the whole of two scans tells the turn to a fraction of a degree, where there are no
    lines, too (SPEC 2.6). The noise of a scan is in the increments before and after it and in the
    lines that it shows, so that of what a match tells, a share is believed.
    """

    measures = True

    def __init__(self, inner: MotionPredictor, rig: Rig, observation: Observation) -> None:
        """observation: the first one."""
        self._inner, self.errors = inner, inner.errors
        self._scans, self._matcher = ScanStream(rig, observation), ScanMatcher()
        self._last = self._new_surface(observation, None)

    def predict(self, observation: Observation, biases: Array) -> Increment:
        increment = self._inner.predict(observation, biases)
        before, self._last = self._last, self._new_surface(observation, increment.pose)
        if before is None or self._last is None:
            return increment
        match = self._matcher.match(
            self._last,
            make_reference([before], np.zeros(3)),
            increment.pose,
            increment.covariance,
        )
        return _combined(increment, match)

    def learn(self, increment: Array | None) -> None:
        self._inner.learn(increment)

    def tell(self, biases: Array, covariance: Array) -> dict[str, float]:
        return self._inner.tell(biases, covariance)

    def _new_surface(self, observation: Observation, increment: Array | None) -> Surface | None:
        """Of the scan that came with this observation; None where none came."""
        scan = self._scans.next(observation, increment)
        if scan is None:
            return None
        surface = surface_of(scan)
        return surface if len(surface.points) >= _FEWEST else None


def _combined(increment: Increment, match: ScanMatch) -> Increment:
    """The increment, corrected by what is believed of a match."""
    prior = np.linalg.inv(increment.covariance)
    information = _believed(match)
    C = np.linalg.inv(prior + information)
    # The match's pose is what scan and guess say together, in proportion of their information;
    # in what the scan tells it is the scan's, and where it tells nothing it is the guess.
    off = match.pose - increment.pose
    off[2] = wrap(off[2])
    pose = increment.pose + C @ information @ off
    pose[2] = wrap(pose[2])
    return Increment(pose, (C + C.T) / 2, C @ prior @ increment.by_biases, increment.measured)


def _believed(match: ScanMatch) -> Array:
    """(3, 3) information on the increment: none of a match that hardly fits, less where few points
    do, and in no direction more than a floor of its noise allows."""
    if match.score < _WORST_SCORE or match.inlier_ratio < _FEWEST_INLIERS:
        return np.zeros((3, 3))
    share = _SHARE * min(1.0, (match.inlier_ratio / _FULL_INLIERS) ** 2)
    # In units of the floor, information i becomes i / (1 + i): variances add up.
    to = np.diag(_FLOOR)
    values, vectors = np.linalg.eigh(to @ (share * match.information) @ to)
    values = np.maximum(values, 0.0)
    bounded = (vectors * (values / (1 + values))) @ vectors.T
    back = np.diag(1 / _FLOOR)
    return np.asarray(back @ bounded @ back)


_FEWEST = 20
"""Returns of a scan that tells anything."""
_WORST_SCORE, _FEWEST_INLIERS, _FULL_INLIERS = 0.25, 0.2, 0.5
"""Of a match that is believed at all, and from which share of inliers on it is believed fully."""
_SHARE = 0.25
"""Of its information: the noise of a scan is in two increments, and in the lines that correct what
comes of them."""
_FLOOR = np.array([0.01, 0.01, np.radians(0.25)])
"""m, m, rad: no motion is known better by two scans, which hide more than noise: people, glass, a
floor that tilts."""
