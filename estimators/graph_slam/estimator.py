"""`graph-line-slam`: scans as a pose graph, with loops that are closed only when in no doubt."""

from typing import ClassVar

import numpy as np

from grouser.checks import require_positive
from grouser.estimators.base import Observation, PoseEstimate, PoseEstimator
from grouser.estimators.evaluation.smoother import Smoother
from grouser.estimators.graph_slam.front_end import FrontEnd
from grouser.estimators.graph_slam.keyframes import Keyframes
from grouser.estimators.graph_slam.loops import LoopCloser, LoopOptions
from grouser.estimators.graph_slam.pose_graph import PoseGraph
from grouser.estimators.graph_slam.verification import FitOptions
from grouser.estimators.line_slam.motion_source import motion_source
from grouser.estimators.line_slam.scan_stream import ScanStream
from grouser.estimators.line_slam.support import Support
from grouser.estimators.scan_matching.surface import Surface, surface_of
from grouser.geometry import Array, between, compose
from grouser.kernels import announce
from grouser.rig import Rig


class GraphLineSlam(PoseEstimator, Smoother):
    """Graph SLAM, the rival of EKF line SLAM (SPEC 2.6), in the frame of the start.

    Every scan is laid over the last ones; those that are kept are the poses of a graph. One that
    fits where the robot was long ago closes a loop, when it fits nowhere else and others along the
    way agree; the graph is then solved by sparse least squares. The estimate is that of now: what
    a loop corrects of earlier poses is `trajectory`.
    """

    requires: ClassVar[frozenset[str]] = frozenset({"lidar", "stamp"})
    optional: ClassVar[frozenset[str]] = frozenset({"tracks", "steering", "odometry", "imu"})

    def __init__(
        self,
        rig: Rig,
        *,
        odometry: str | None = None,
        keyframe_distance: float = 0.5,
        keyframe_turn: float = 0.3,
        loops: LoopOptions | None = None,
        fit: FitOptions | None = None,
        supported_for: float = 0.5,
    ) -> None:
        """
        Args:
            rig: the calibration; its `lidar`, and of what measures the motion.
            odometry: what predicts: "steering", "tracks", "odometry", or the name of an estimator
                whose increments do. None takes the first of these three that the rig has.
            keyframe_distance: m from the last scan that was kept, after which one is kept;
            keyframe_turn: the same for the heading, rad.
            loops: when a loop is closed; left out, as `LoopOptions` has it.
            fit: when a scan fits an old one; left out, as `FitOptions` has it.
            supported_for: s that a scan that fits supports the estimate.

        Raises:
            ValueError: an option out of range, or a rig without lidar, or that knows no motion.
        """
        if rig.lidar is None:
            raise ValueError(
                "graph-line-slam needs rig.lidar, and this rig has None; make the environment with "
                "the sensor 'lidar'"
            )
        announce()
        self._make_motion = motion_source(rig, odometry, readable=self.requires | self.optional)
        self._rig = rig
        self._field_of_view = rig.lidar.n_beams * abs(rig.lidar.angle_increment)
        self.keyframe_distance, self.keyframe_turn = keyframe_distance, keyframe_turn
        self.supported_for = supported_for
        require_positive(self, "keyframe_distance", "keyframe_turn", "supported_for")
        self._loops, self._fit = loops or LoopOptions(), fit or FitOptions()
        self._started = False

    @property
    def trajectory(self) -> Array:
        """(n, 3) the pose of each observation since `reset`, as it is known now."""
        self._check_started()
        nodes = np.array([node for node, _ in self._frames])
        motions = np.array([motion for _, motion in self._frames])
        self._settle()
        return compose(self._graph.poses[nodes], motions)

    @property
    def closures(self) -> list[tuple[int, int, Array]]:
        """The loops that were closed: numbers of two observations, and the pose (3,) of the second
        as seen from the first."""
        self._check_started()
        kept = self._kept
        return [(kept[i], kept[j], pose) for i, j, pose in self._graph.closures]

    def reset(self, observation: Observation, *, rng: np.random.Generator) -> PoseEstimate:
        """Start at pose zero, known exactly, with the first scan.

        Raises:
            ValueError: the scan is not one of this lidar.
        """
        self._graph, self._keyframes = PoseGraph(), Keyframes()
        self._front = FrontEnd(self._make_motion(observation, rng))
        self._closer = LoopCloser(self._loops, self._fit, self._field_of_view)
        self._support = Support(self.supported_for)
        self._unsettled = 0
        self._scans = ScanStream(self._rig, observation)
        scan = self._scans.next(observation)
        assert scan is not None, "the first one is always new"
        self._keyframes.append(surface_of(scan), 0.0)
        self._kept, self._frames = [0], [(0, np.zeros(3))]
        self._started = True
        return self._estimate(observation, supported=True)

    def update(self, observation: Observation) -> PoseEstimate:
        """Take the next observation.

        Raises:
            RuntimeError: `reset` was not called yet.
            ValueError: a scan or a motion that is not what the contract says.
        """
        self._check_started()
        before = self._front.pose
        self._front.predict(observation)
        supported = False
        scan = self._scans.next(observation, between(before, self._front.pose))
        if scan is not None:
            surface = surface_of(scan)
            supported = self._front.correct(surface, self._graph, self._keyframes)
            if self._moved_on():
                self._keep(surface)
        self._frames.append((len(self._graph) - 1, self._front.pose.copy()))
        return self._estimate(observation, supported=supported)

    def _moved_on(self) -> bool:
        """Whether the scan is to be kept: far enough from the last one that was, and without doubt
        where it was taken, as long as one can wait."""
        x, y, turn = self._front.pose.tolist()
        wait = _PATIENCE if self._front.doubtful else 1.0
        far, turned = wait * self.keyframe_distance, wait * self.keyframe_turn
        return bool(np.hypot(x, y) >= far or abs(turn) >= turned)

    def _keep(self, surface: Surface) -> None:
        """Make the scan a keyframe, and close the loops that it makes sure of."""
        motion = self._front.pose
        self._graph.append(
            compose(self._graph.poses[-1], motion), motion, self._front.edge_covariance()
        )
        self._keyframes.append(surface, float(np.hypot(motion[0], motion[1])))
        self._kept.append(len(self._frames))
        self._front.start_keyframe()
        for closure in (closures := self._closer.look(self._graph, self._keyframes)):
            self._graph.close(closure.old, closure.new, closure.pose, closure.information)
        self._unsettled += len(closures)
        if closures:
            off = compose(self._graph.poses[closures[-1].old], closures[-1].pose)
            off = off - self._graph.poses[-1]
            if self._unsettled >= _OFTEN or np.hypot(off[0], off[1]) > _FAR:
                self._settle()

    def _settle(self) -> None:
        """Solve the graph, if a loop was closed since."""
        if self._unsettled:
            self._graph.optimise()
            self._closer.forget_references()
            self._front.forget_reference()
            self._unsettled = 0

    def _check_started(self) -> None:
        if not self._started:
            raise RuntimeError("call reset() with the first observation first")

    def _estimate(self, observation: Observation, *, supported: bool) -> PoseEstimate:
        pose, covariance = self._front.seen_from(self._graph.poses[-1], self._graph.covariance)
        return self._support.estimate(
            observation,
            pose,
            covariance,
            supported=supported,
            diagnostics={
                "keyframes": float(len(self._keyframes)),
                "loops": float(self._graph.loops),
            },
        )


_PATIENCE = 4.0
"""Times the usual way or turn for which a scan that is in doubt is not kept"""
_OFTEN = 8
"""Closures after which the graph is solved"""
_FAR = 0.05
"""m by which a closure corrects, from which on it is solved at once"""
