"""`ekf-line-slam`: paper 2's filter as a pose estimator, with its options."""

from pathlib import Path
from typing import ClassVar

import numpy as np

from grouser.estimators.base import Observation, PoseEstimate, PoseEstimator
from grouser.estimators.line_slam.association import AssociationOptions
from grouser.estimators.line_slam.ekf import LineEkfOptions
from grouser.estimators.line_slam.engine import LineSlam
from grouser.estimators.line_slam.map import LineMap, LineMapper
from grouser.estimators.line_slam.motion_source import motion_source
from grouser.geometry import Array
from grouser.rig import Rig


class EkfLineSlam(PoseEstimator, LineMapper):
    """EKF SLAM with lines as landmarks (SPEC 2.2), in the frame of the start.

    Lines come from the observation `lines` or, without it, from `lidar`; the motion from
    `steering`, `tracks` or `odometry`, or from another estimator's increments. A scan none of
    whose lines is one of the map's is bridged by the motion (COASTING).
    """

    requires: ClassVar[frozenset[str]] = frozenset({"stamp"})
    optional: ClassVar[frozenset[str]] = frozenset(
        {"lines", "lidar", "tracks", "steering", "odometry", "imu"}
    )
    requires_one_of: ClassVar[tuple[frozenset[str], ...]] = (frozenset({"lines", "lidar"}),)

    def __init__(
        self,
        rig: Rig,
        *,
        odometry: str | None = None,
        paper: bool = False,
        jacobians: str = "standard",
        map: str | Path | LineMap | None = None,
        start_sigma: tuple[float, float, float] = (0.0, 0.0, 0.0),
        gate: float = 9.21,
        new_above: float = 25.0,
        unevenness: float | None = None,
        supported_for: float = 0.5,
    ) -> None:
        """
        Args:
            rig: the calibration; `line_sensor` or `lidar`, and of what measures the motion.
            odometry: what predicts: "steering", "tracks", "odometry", or the name of an estimator
                whose increments do. None takes the first of these three that the rig has.
            paper: the motion's Jacobians (6) and (7) as printed, with two wrong signs.
            jacobians: "standard", "first-estimates" or "right-invariant": where the filter
                linearises, which decides how sure it becomes of its heading.
            map: a map that was saved by `save_line_map`, or its path, in the frame of this start:
                the way is found by it, and no line is added.
            start_sigma: how well the start is known in the frame of `map`: x, y [m], heading
                [rad], one sigma.
            gate: squared innovation over its covariance up to which a line is one of the map's.
            new_above: the same to the nearest, above which a line is new.
            unevenness: m that walls in scans are off the lines they are taken for; None learns it
                from how well they fit.
            supported_for: s that a look at lines supports the estimate.

        Raises:
            ValueError: an option out of range, or a rig that sees no lines or knows no motion.
        """
        self._slam = LineSlam(
            rig,
            motion_source(
                rig,
                odometry,
                readable=self.requires | self.optional,
                paper=paper,
                scan_aided=True,
            ),
            jacobians=jacobians,
            map=map,
            start_sigma=start_sigma,
            options=LineEkfOptions(
                AssociationOptions(gate=gate, new_above=new_above), learns=map is None
            ),
            unevenness=unevenness,
            supported_for=supported_for,
        )

    @property
    def map(self) -> LineMap:
        return self._slam.map

    @property
    def matches(self) -> tuple[Array, Array]:
        """Of the last observation: (k, 2) lines of the map that corrected the estimate, r [m] and
        alpha [rad], and (k, 2) each as it was seen from the robot; see `lines.py`.

        Raises:
            RuntimeError: `reset` was not called yet.
        """
        return self._slam.matches

    def reset(self, observation: Observation, *, rng: np.random.Generator) -> PoseEstimate:
        """Start at pose zero: known exactly, or in the frame of a map as `start_sigma` says.

        Raises:
            ValueError: the observation shows neither lines nor a scan.
        """
        return self._slam.reset(observation, rng=rng)

    def update(self, observation: Observation) -> PoseEstimate:
        """Take the next observation.

        Raises:
            RuntimeError: `reset` was not called yet.
            ValueError: lines or motion that are not what the contract says.
        """
        return self._slam.update(observation)
