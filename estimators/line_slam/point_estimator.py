"""`ekf-point-slam`: paper 2's point model as a pose estimator, with its options."""

from typing import ClassVar

import numpy as np

from grouser.checks import did_you_mean
from grouser.estimators.base import Observation, PoseEstimate, PoseEstimator
from grouser.estimators.line_slam.motion_source import motion_source
from grouser.estimators.line_slam.point_ekf import PointEkf, PointEkfOptions, PointsTold
from grouser.estimators.line_slam.point_sight import EstimatedFeet, PointSight, ReportedPoints
from grouser.estimators.line_slam.points import PointMap
from grouser.estimators.line_slam.state import LineState
from grouser.estimators.line_slam.support import Support
from grouser.kernels import announce
from grouser.rig import Rig
from grouser.rig_motion import LineSensor

LANDMARKS = ("points", "estimated-feet")


class EkfPointSlam(PoseEstimator):
    """EKF SLAM with points as landmarks: paper 2, eqs. (10) to (13), in the frame of the start.

    Points come from the observation `points`, or are feet on the `lines` that are seen, found by
    the estimated pose as the paper's section 1.3 has it. Motion as for ekf-line-slam.
    """

    requires: ClassVar[frozenset[str]] = frozenset({"stamp"})
    optional: ClassVar[frozenset[str]] = frozenset(
        {"points", "lines", "tracks", "steering", "odometry"}
    )

    def __init__(
        self,
        rig: Rig,
        *,
        landmarks: str = "points",
        odometry: str | None = None,
        paper: bool = False,
        paper_observation: bool = False,
        origin: tuple[float, float] = (0.0, 0.0),
        gate: float = 9.21,
        new_above: float = 25.0,
        supported_for: float = 0.5,
    ) -> None:
        """
        Args:
            rig: the calibration; `line_sensor`, and of what measures the motion.
            landmarks: "points" that are reported, or "estimated-feet": the foot of the world's
                origin on every line, which is no measurement of it (SPEC 2.1).
            odometry: what predicts: "steering", "tracks", "odometry", or the name of an estimator
                whose increments do. None takes the first of these three that the rig has.
            paper: the motion's Jacobians (6) and (7) as printed, with two wrong signs.
            paper_observation: eq. (11) as printed, with two wrong entries.
            origin: that of the world in the frame of the start, m, for "estimated-feet".
            gate: squared innovation over its covariance up to which a point is one of the map's.
            new_above: the same to the nearest, above which a point is new.
            supported_for: s that a look at points supports the estimate.

        Raises:
            ValueError: an option out of range, or a rig that sees no points or knows no motion.
        """
        if landmarks not in LANDMARKS:
            raise ValueError(
                f"landmarks must be one of {', '.join(LANDMARKS)}, got {landmarks!r}; "
                f"{did_you_mean(landmarks, LANDMARKS)}"
            )
        if rig.line_sensor is None:
            raise ValueError(
                "point SLAM needs rig.line_sensor, whose noises are those of points, and this rig "
                "has none; make the environment with the sensor 'points' or 'lines'"
            )
        announce()
        self._sensor: LineSensor = rig.line_sensor
        self._landmarks, self._origin = landmarks, np.array(origin, dtype=np.float64)
        self._make_motion = motion_source(
            rig, odometry, readable=self.requires | self.optional, paper=paper
        )
        self._options = PointEkfOptions(gate, new_above, printed=paper_observation)
        self._supported_for = supported_for
        self._filter: PointEkf | None = None

    @property
    def map(self) -> PointMap:
        """The points as they are known now.

        Raises:
            RuntimeError: `reset` was not called yet.
        """
        return self._running().known()

    def reset(self, observation: Observation, *, rng: np.random.Generator) -> PoseEstimate:
        """Start at pose zero, known exactly.

        Raises:
            ValueError: the observation does not show what landmarks are made of.
        """
        self._sight = self._make_sight(observation)
        self._support = Support(self._supported_for)
        motion = self._make_motion(observation, rng)
        self._filter = PointEkf(LineState(np.zeros(3), motion.errors.sigmas), motion, self._options)
        return self._estimate(observation, self._filter.look(observation, self._sight))

    def update(self, observation: Observation) -> PoseEstimate:
        """Take the next observation.

        Raises:
            RuntimeError: `reset` was not called yet.
            ValueError: points, lines or motion that are not what the contract says.
        """
        return self._estimate(observation, self._running().step(observation, self._sight))

    def _make_sight(self, observation: Observation) -> PointSight:
        key = "points" if self._landmarks == "points" else "lines"
        if key not in observation:
            raise ValueError(
                f"landmarks={self._landmarks!r} needs {key!r}, but the environment gives "
                f"{sorted(observation)}; make it with sensors= that include it"
            )
        if key == "points":
            return ReportedPoints(self._sensor)
        return EstimatedFeet(self._sensor, self._origin)

    def _running(self) -> PointEkf:
        if self._filter is None:
            raise RuntimeError("call reset() with the first observation first")
        return self._filter

    def _estimate(self, observation: Observation, told: PointsTold) -> PoseEstimate:
        state = self._running().state
        return self._support.estimate(
            observation,
            state.pose,
            state.pose_covariance,
            supported=told.matched + told.new > 0,
            diagnostics={
                "points_in_map": float(len(state)),
                "points_seen": float(told.seen),
                "points_matched": float(told.matched),
                "points_new": float(told.new),
                "nis": told.nis,
            },
        )
