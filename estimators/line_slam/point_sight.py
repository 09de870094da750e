"""What shows a robot points: a sensor that reports them, or feet on lines by the estimated pose."""

from abc import ABC, abstractmethod

import numpy as np
from numpy.typing import NDArray

from grouser.estimators.base import Observation, stamp_of
from grouser.estimators.line_slam.lines import lines_to_world, normals
from grouser.estimators.line_slam.points import polar
from grouser.estimators.line_slam.sight import EndPointSight
from grouser.geometry import Array
from grouser.rig_motion import LineSensor


class PointSight(ABC):
    """Points around a robot by range and bearing, one look after another."""

    sigmas: Array
    """(2,) of range [m] and bearing [rad]."""

    @abstractmethod
    def points(self, observation: Observation, pose: Array) -> Array | None:
        """(n, 2) range and bearing that a new look shows; None where the observation holds none.

        Args:
            pose: (3,) as estimated.
        """


class ReportedPoints(PointSight):
    """A sensor tells them, as `points`."""

    def __init__(self, sensor: LineSensor) -> None:
        self.sigmas = np.array([sensor.sigma_range, sensor.sigma_bearing])
        self._stamp: float | None = None

    def points(self, observation: Observation, pose: Array) -> Array | None:
        stamp = stamp_of("points", observation)
        if stamp == self._stamp:
            return None
        self._stamp = stamp
        reported: NDArray[np.float64] = np.array(observation["points"], dtype=np.float64)
        if reported.ndim != 2 or reported.shape[1] != 2 or not np.isfinite(reported).all():
            raise ValueError(
                "observation 'points' must be finite rows of range and bearing, (n, 2), got "
                f"{reported.tolist()} of shape {reported.shape}"
            )
        return reported[reported.any(axis=1)]


class EstimatedFeet(PointSight):
    """Paper 2's section 1.3: the foot of the world's origin on each line, found by the estimated
    pose, and then taken for a point that was seen from it.

    It is no measurement: it tells nothing of where along a line the robot is, but is believed to,
    and of the pose it tells what went in (SPEC 2.1). It is here to be measured.
    """

    def __init__(self, sensor: LineSensor, origin: Array) -> None:
        """origin: (2,) that of the world in the frame of the start, m."""
        self.sigmas = np.array([sensor.sigma_range, sensor.sigma_bearing])
        self._lines, self._origin = EndPointSight(sensor), origin

    def points(self, observation: Observation, pose: Array) -> Array | None:
        seen = self._lines.lines(observation)
        if seen is None:
            return None
        lines = lines_to_world(seen.lines, pose)
        n = normals(lines[:, 1])
        feet = self._origin + (lines[:, 0] - n @ self._origin)[:, None] * n
        return polar(feet, pose)
