"""What shows a robot lines, and when it was looked at last."""

from abc import ABC, abstractmethod
from typing import ClassVar

from grouser.estimators.base import Observation, stamp_of
from grouser.estimators.line_slam.endpoint_sensor import measure_lines
from grouser.estimators.line_slam.extraction import ExtractionOptions, LineExtractor
from grouser.estimators.line_slam.measurements import LineMeasurements
from grouser.estimators.line_slam.scan_stream import ScanStream
from grouser.geometry import Array
from grouser.rig import Rig
from grouser.rig_motion import LineSensor


class Sight(ABC):
    """Lines around a robot, one look after another."""

    of_surfaces: ClassVar[bool]
    """Whether they are found on surfaces, which are uneven; if not, lines are what they are."""

    @abstractmethod
    def lines(
        self, observation: Observation, increment: Array | None = None
    ) -> LineMeasurements | None:
        """What a new look shows; None where the observation holds none.

        Args:
            increment: (3,) how the robot moved since the observation before, as far as is known.
        """


class EndPointSight(Sight):
    """By a sensor that reports the ends of lines."""

    of_surfaces = False

    def __init__(self, sensor: LineSensor) -> None:
        self._sensor = sensor
        self._stamp: float | None = None

    def lines(
        self, observation: Observation, increment: Array | None = None
    ) -> LineMeasurements | None:
        stamp = stamp_of("lines", observation)
        if stamp == self._stamp:
            return None
        self._stamp = stamp
        return measure_lines(observation["lines"], self._sensor)


_SHORTEST = 1.0
"""m (SPEC 2.5): shorter parts are more often things than walls, and tell little of a direction."""


class LidarSight(Sight):
    """By a lidar, in whose scans lines are found."""

    of_surfaces = True

    def __init__(self, rig: Rig, observation: Observation) -> None:
        """observation: the first one."""
        assert rig.lidar is not None
        self._extractor = LineExtractor(rig.lidar, ExtractionOptions(min_length=_SHORTEST))
        self._scans = ScanStream(rig, observation)

    def lines(
        self, observation: Observation, increment: Array | None = None
    ) -> LineMeasurements | None:
        scan = self._scans.next(observation, increment)
        return None if scan is None else self._extractor.lines_of(scan)


def make_sight(rig: Rig, observation: Observation) -> Sight:
    """What shows lines in observations like this one.

    Raises:
        ValueError: nothing does.
    """
    if rig.line_sensor is not None and "lines" in observation:
        return EndPointSight(rig.line_sensor)
    if rig.lidar is not None and "lidar" in observation:
        return LidarSight(rig, observation)
    raise ValueError(
        "line SLAM needs 'lines' with rig.line_sensor, or 'lidar' with rig.lidar, but the "
        f"environment gives {sorted(observation)}; make it with sensors= that include one of them"
    )
