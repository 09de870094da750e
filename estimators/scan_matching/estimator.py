"""`scan-matching`: lidar odometry, each scan laid over the last ones, as a pose estimator."""

from dataclasses import replace
from functools import partial
from typing import ClassVar

import numpy as np

from grouser.checks import require_not_negative
from grouser.estimators.base import Observation, PoseEstimate, PoseEstimator
from grouser.estimators.cruise_predictor import CruisePredictor
from grouser.estimators.line_slam.motion import MotionModel, PredictedMotion
from grouser.estimators.line_slam.motion_source import OWN, MakeMotion, motion_source
from grouser.estimators.line_slam.scan_stream import ScanStream
from grouser.estimators.line_slam.support import Support
from grouser.estimators.scan_matching.local_map import LocalMap, LocalMapOptions
from grouser.estimators.scan_matching.matcher import MatchOptions, ScanMatch, ScanMatcher
from grouser.estimators.scan_matching.search import SearchOptions
from grouser.estimators.scan_matching.surface import Surface, own_covariance, surface_of
from grouser.estimators.scan_matching.window_filter import WindowFilter
from grouser.geometry import Array, between
from grouser.rig import Rig


class ScanMatching(PoseEstimator):
    """Lidar odometry: correlative search and point-to-line alignment over the last keyframe scans
    (SPEC 2.6), with a covariance that grows as the map itself drifts.

    `tracks`, `odometry` or `steering` tell where to search, and the pose where a scan does not, as
    along a corridor; without them the robot is expected to go on as it went. A scan of which too
    little lies on the map is not believed (COASTING).
    """

    requires: ClassVar[frozenset[str]] = frozenset({"stamp", "lidar"})
    optional: ClassVar[frozenset[str]] = frozenset({"tracks", "steering", "odometry", "imu"})

    def __init__(
        self,
        rig: Rig,
        *,
        odometry: str | None = None,
        match: MatchOptions | None = None,
        local_map: LocalMapOptions | None = None,
        least_inliers: float = 0.1,
        supported_for: float = 0.5,
    ) -> None:
        """
        Args:
            rig: the calibration; its `lidar`, and of what measures the motion.
            odometry: what predicts: "steering", "tracks", "odometry", the name of an estimator
                whose increments do, or "none": the velocity stays nearly the same. None takes the
                first of the three that the rig has, and "none" without any.
            match: how a scan is matched; left out, as `MatchOptions` has it.
            local_map: which scans it is matched with; left out, as `LocalMapOptions` has it.
            least_inliers: share of a scan's points that must lie on the map.
            supported_for: s that a match supports the estimate.

        Raises:
            ValueError: an option out of range, or a rig without lidar.
        """
        if rig.lidar is None:
            raise ValueError(
                "scan matching needs rig.lidar, and this rig has None; make the environment with "
                "the sensor 'lidar'"
            )
        self._rig = rig
        self._make_motion = _motion(rig, odometry, self.requires | self.optional)
        self._options = match or MatchOptions()
        self._local_map = local_map or LocalMapOptions()
        self._least_inliers, self._supported_for = least_inliers, supported_for
        require_not_negative(self, "_least_inliers")
        Support(supported_for)  # raises, if it is out of range
        self._filter: WindowFilter | None = None

    def reset(self, observation: Observation, *, rng: np.random.Generator) -> PoseEstimate:
        """Start at pose zero, known exactly, with the first scan as the map.

        Raises:
            ValueError: the scan is of another lidar.
        """
        self._filter = WindowFilter(self._make_motion(observation, rng))
        self._map = LocalMap(self._local_map)
        self._support = Support(self._supported_for)
        self._scans = ScanStream(self._rig, observation)
        surface = self._surface(observation, None)
        self._extend(self._filter, surface)
        return self._estimate(self._filter, observation, None)

    def update(self, observation: Observation) -> PoseEstimate:
        """Take the next observation.

        Raises:
            RuntimeError: `reset` was not called yet.
            ValueError: a scan of another lidar, or motion that is not what the contract says.
        """
        if self._filter is None:
            raise RuntimeError("call reset() with the first observation first")
        filter, before = self._filter, self._filter.pose.copy()
        filter.predict(observation)
        surface = self._surface(observation, between(before, filter.pose))
        match = self._match(filter, surface)
        filter.learn(before)
        self._extend(filter, surface)
        return self._estimate(filter, observation, match)

    def _surface(self, observation: Observation, increment: Array | None) -> Surface | None:
        """What a new scan shows, given how the robot moved since the observation before; None where
        there is none, or too little in it."""
        scan = self._scans.next(observation, increment)
        if scan is None:
            return None
        surface = surface_of(scan)
        return surface if np.isfinite(surface.normal_sigmas).sum() >= _FEWEST else None

    def _match(self, filter: WindowFilter, surface: Surface | None) -> ScanMatch | None:
        """The scan laid over the map, by which the pose is corrected; None where it does not
        fit."""
        if surface is None or not len(self._map):
            return None
        keyframes = self._map.poses
        around = filter.relative_covariance(keyframes[-1])
        matcher = ScanMatcher(replace(self._options, search=_wide(self._options.search, around)))
        match = matcher.match(surface, self._map.reference, filter.pose, around)
        if match.inlier_ratio < self._least_inliers:
            return None
        filter.correct(match, around, keyframes)
        return match

    def _extend(self, filter: WindowFilter, surface: Surface | None) -> None:
        if surface is None or not self._map.wants(filter.pose):
            return
        filter.remember(own_covariance(surface))
        filter.forget_oldest(self._map.add(surface, filter.pose))

    def _estimate(
        self, filter: WindowFilter, observation: Observation, match: ScanMatch | None
    ) -> PoseEstimate:
        diagnostics = {"scans_in_map": float(len(self._map))}
        if match is not None:
            diagnostics |= {
                "score": match.score,
                "inlier_ratio": match.inlier_ratio,
                "eigenvalue_ratio": match.eigenvalue_ratio,
            }
        return self._support.estimate(
            observation,
            filter.pose,
            filter.covariance,
            supported=match is not None,
            diagnostics=diagnostics,
        )


def _motion(rig: Rig, name: str | None, readable: frozenset[str]) -> MakeMotion:
    if name is None:
        name = next((part for part in OWN if getattr(rig, part) is not None), "none")
    if name == "none":
        return partial(_cruise, rig.dt)
    return motion_source(rig, name, readable=readable)


def _cruise(dt: float, observation: Observation, rng: np.random.Generator) -> MotionModel:
    return PredictedMotion(CruisePredictor(dt, fastest=_FASTEST))


def _wide(search: SearchOptions, covariance: Array) -> SearchOptions:
    """The search, wider where the guess is less sure than it is wide."""
    position = _SIGMAS * float(np.sqrt(np.linalg.eigvalsh(covariance[:2, :2])[-1]))
    heading = _SIGMAS * float(np.sqrt(covariance[2, 2]))
    return replace(
        search,
        position=max(search.position, min(position, _WIDEST)),
        heading=max(search.heading, min(heading, _WIDEST_TURN)),
    )


_FEWEST = 10
"""Points with a normal that a scan needs"""
_FASTEST = 1.5  # m/s, one sigma of what a robot may drive at the start
_SIGMAS = 2.5
_WIDEST, _WIDEST_TURN = 1.5, 0.8  # m, rad
