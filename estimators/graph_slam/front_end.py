"""The motion since the last keyframe: what the robot measured, corrected by the scan it sees."""

from math import radians

import numpy as np

from grouser.estimators.base import Observation
from grouser.estimators.graph_slam.keyframes import Keyframes
from grouser.estimators.graph_slam.pose_graph import PoseGraph
from grouser.estimators.line_slam.motion import MotionModel
from grouser.estimators.scan_matching.matcher import ScanMatcher
from grouser.estimators.scan_matching.reference import Reference
from grouser.estimators.scan_matching.surface import Surface
from grouser.geometry import Array, compose, compose_jacobians


class FrontEnd:
    """The robot's pose (3,) as seen from the last keyframe, with its covariance (3, 3)."""

    def __init__(self, motion: MotionModel) -> None:
        self._motion = motion
        self._matcher = ScanMatcher()
        self._reference: Reference | None = None
        self.doubtful = False
        """Whether the last scan might as well have been taken elsewhere."""
        self.start_keyframe()

    def start_keyframe(self) -> None:
        """The robot is where a new keyframe is."""
        self.pose, self.covariance = np.zeros(3), np.zeros((3, 3))
        self._reference = None

    def forget_reference(self) -> None:
        """The graph has moved."""
        self._reference = None

    def predict(self, observation: Observation) -> None:
        """Move as the robot measured it; nothing learns its constant errors."""
        errors = self._motion.errors
        step = self._motion.predict(observation, self.pose, np.zeros(len(errors)))
        constant = step.by_errors @ np.diag(errors.sigmas**2) @ step.by_errors.T
        P = step.by_pose @ self.covariance @ step.by_pose.T + step.covariance + constant
        self.pose, self.covariance = step.pose, (P + P.T) / 2
        self.doubtful = False

    def correct(self, surface: Surface, graph: PoseGraph, keyframes: Keyframes) -> bool:
        """Lay the scan over the last ones; whether it fits."""
        if len(surface.points) < _POINTS:
            return False
        last = graph.poses[-1]
        if self._reference is None:
            which = keyframes.last(_SCANS, _WAY)
            self._reference = keyframes.reference(which, graph.poses, last)
        match = self._matcher.match(surface, self._reference, self.pose, self.covariance + _LEAST)
        if match.score < _SCORE:
            return False
        self._motion.learn(np.zeros(3), match.pose)
        self.pose, self.doubtful = match.pose, bool(match.doubt.any())
        self.covariance = match.covariance + np.outer(match.doubt, match.doubt)
        return True

    def edge_covariance(self) -> Array:
        """(3, 3) of the motion between two keyframes: the scans about the last one are known from
        it but so well, and the better the nearer they are."""
        way = float(np.hypot(self.pose[0], self.pose[1]))
        position, heading = (
            _POSITION + _POSITION_PER_METRE * way,
            _HEADING + _HEADING_PER_METRE * way,
        )
        return np.asarray(self.covariance + np.diag([position, position, heading]) ** 2)

    def seen_from(self, keyframe: Array, covariance: Array) -> tuple[Array, Array]:
        """The robot's pose, and its covariance, from those of the last keyframe."""
        by_keyframe, by_motion = compose_jacobians(keyframe, self.pose)
        P = by_keyframe @ covariance @ by_keyframe.T + by_motion @ self.covariance @ by_motion.T
        return compose(keyframe, self.pose), (P + P.T) / 2


_SCANS, _WAY = 25, 20.0
"""Keyframes and m of the way that a scan is laid over (SPEC 2.6)"""
_POINTS, _SCORE = 15, 0.25
"""What a scan must have to be laid over others, and to be believed"""
_LEAST = np.diag([0.01, 0.01, radians(0.1)]) ** 2
_POSITION, _POSITION_PER_METRE = 0.01, 0.01
_HEADING, _HEADING_PER_METRE = radians(0.1), radians(0.15)
