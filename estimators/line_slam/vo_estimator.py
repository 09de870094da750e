"""`vo-line-slam`: vision and lines together."""

from typing import ClassVar

import numpy as np

from grouser.estimators.base import Observation, PoseEstimate, PoseEstimator
from grouser.estimators.line_slam.association import AssociationOptions
from grouser.estimators.line_slam.ekf import LineEkfOptions
from grouser.estimators.line_slam.engine import LineSlam
from grouser.estimators.line_slam.map import LineMap, LineMapper
from grouser.estimators.line_slam.motion_source import motion_source
from grouser.rig import Rig


class VoLineSlam(PoseEstimator, LineMapper):
    """EKF SLAM with lines whose motion is that of visual odometry: paper 1 predicts, paper 2
    corrects.

    Lines come from the observation `lines` or, without it, from `lidar`. What vision is unsure of,
    lines in sight correct; where there are none, vision bridges (COASTING).
    """

    requires: ClassVar[frozenset[str]] = frozenset({"left", "right", "stamp"})
    optional: ClassVar[frozenset[str]] = frozenset({"lines", "lidar", "tracks", "imu"})

    def __init__(
        self,
        rig: Rig,
        *,
        odometry: str = "one-point-ransac",
        jacobians: str = "standard",
        gate: float = 9.21,
        new_above: float = 25.0,
        unevenness: float | None = None,
        supported_for: float = 0.5,
    ) -> None:
        """
        Args:
            rig: the calibration; `line_sensor` or `lidar`, and of what the odometry needs.
            odometry: the name of the estimator whose increments predict.
            jacobians: "standard", "first-estimates" or "right-invariant", as for ekf-line-slam.
            gate: squared innovation over its covariance up to which a line is one of the map's.
            new_above: the same to the nearest, above which a line is new.
            unevenness: m that walls in scans are off the lines they are taken for; None learns it
                from how well they fit.
            supported_for: s that a look at lines supports the estimate.

        Raises:
            ValueError: an option out of range, or a rig that sees no lines or lacks what the
                odometry needs.
        """
        self._slam = LineSlam(
            rig,
            motion_source(rig, odometry, readable=self.requires | self.optional),
            jacobians=jacobians,
            map=None,
            start_sigma=(0.0, 0.0, 0.0),
            options=LineEkfOptions(AssociationOptions(gate=gate, new_above=new_above)),
            unevenness=unevenness,
            supported_for=supported_for,
        )

    @property
    def map(self) -> LineMap:
        return self._slam.map

    def reset(self, observation: Observation, *, rng: np.random.Generator) -> PoseEstimate:
        """Start at pose zero.

        Raises:
            ValueError: the observation shows neither lines nor a scan.
        """
        return self._slam.reset(observation, rng=rng)

    def update(self, observation: Observation) -> PoseEstimate:
        """Take the next observation.

        Raises:
            RuntimeError: `reset` was not called yet.
            ValueError: lines, images or increments that are not what the contract says.
        """
        return self._slam.update(observation)
