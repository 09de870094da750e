"""A predictor whose increments are made surer by laying each lidar scan over the last ones."""

from dataclasses import replace

import numpy as np

from grouser.estimators.base import Observation
from grouser.estimators.line_slam.scan_stream import ScanStream
from grouser.estimators.scan_matching.local_map import LocalMap, LocalMapOptions
from grouser.estimators.scan_matching.matcher import ScanMatch, ScanMatcher
from grouser.estimators.scan_matching.surface import Surface, surface_of
from grouser.estimators.visual.prediction import Increment, MotionPredictor
from grouser.geometry import Array, between, compose, compose_jacobians, wrap
from grouser.rig import Rig


class ScanAidedPredictor(MotionPredictor):
    """Another predictor's increments, and what scans laid over the last ones tell of the motion.

    Odometry that errs by degrees a metre lets a wrong line turn the heading as far, and nothing
    says so; the whole of the scans tells the turn to a fraction of a degree, where there are no
    lines, too (SPEC 2.6). The noise of a scan is in the increments before and after it and in the
    lines that it shows, so that of what a match tells, a share is believed.
    """

    measures = True

    def __init__(self, inner: MotionPredictor, rig: Rig, observation: Observation) -> None:
        """observation: the first one."""
        self._inner, self.errors = inner, inner.errors
        self._scans, self._matcher = ScanStream(rig, observation), ScanMatcher()
        self._map, self._at = LocalMap(LocalMapOptions()), np.zeros(3)
        self._lay(self._new_surface(observation, None))

    def predict(self, observation: Observation, biases: Array) -> Increment:
        increment = self._inner.predict(observation, biases)
        surface = self._new_surface(observation, increment.pose)
        information = np.zeros((3, 3))
        if surface is not None and len(self._map):
            match = self._matched(surface, increment)
            information = _believed(match)
            increment = _combined(increment, match.pose, information)
        if not information.any():
            # The way from these scans to the next one is known by odometry alone: it would bend
            # their map.
            self._map = LocalMap(LocalMapOptions())
        self._at = compose(self._at, increment.pose)
        self._lay(surface)
        return increment

    def learn(self, increment: Array | None) -> None:
        self._inner.learn(increment)

    def tell(self, biases: Array, covariance: Array) -> dict[str, float]:
        return self._inner.tell(biases, covariance)

    def _lay(self, surface: Surface | None) -> None:
        """Add a scan to the map, if there is one and it adds something."""
        if surface is not None and self._map.wants(self._at):
            self._map.add(surface, self._at)

    def _new_surface(self, observation: Observation, increment: Array | None) -> Surface | None:
        """Of the scan that came with this observation; None where none came."""
        scan = self._scans.next(observation, increment)
        if scan is None:
            return None
        surface = surface_of(scan)
        return surface if len(surface.points) >= _FEWEST else None

    def _matched(self, surface: Surface, increment: Increment) -> ScanMatch:
        """The scan laid over the map, as seen from where the robot was before."""
        _, turned = compose_jacobians(self._at, increment.pose)
        match = self._matcher.match(
            surface,
            self._map.reference,
            compose(self._at, increment.pose),
            turned @ increment.covariance @ turned.T,
        )
        return replace(
            match,
            pose=between(self._at, match.pose),
            information=turned.T @ match.information @ turned,
        )


def _combined(increment: Increment, told: Array, information: Array) -> Increment:
    """The increment, corrected by a match's pose (3,) and what is believed of it."""
    prior = np.linalg.inv(increment.covariance)
    C = np.linalg.inv(prior + information)
    # The match's pose is what scan and guess say together, in proportion of their information;
    # in what the scan tells it is the scan's, and where it tells nothing it is the guess.
    off = told - increment.pose
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
"""m, m, rad: no motion is known better by scans, which hide more than noise: people, glass, a
floor that tilts."""
