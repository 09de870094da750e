"""The scans in a robot's observations, each once: straightened by its motion and levelled by its
inertial unit.

A robot that climbs a sill looks over walls' foot and down at the floor. What it sees ahead is then
farther than walls are, by one over the cosine, and the floor looks like a wall. Where it is known
which way is up, beams are laid onto the level plane, and returns from the floor are left out.
"""

from grouser.estimators.base import Observation, stamp_of
from grouser.estimators.inclination import Inclination
from grouser.estimators.line_slam.scan import Scan, ScanReader, Sweep
from grouser.geometry import Array
from grouser.rig import Rig


class ScanStream:
    """Of one lidar, and of the inertial unit where the robot has one."""

    def __init__(self, rig: Rig, observation: Observation) -> None:
        """observation: the first one; `next` reads its scan.

        Raises:
            ValueError: there is no `rig.lidar`.
        """
        if rig.lidar is None:
            raise ValueError("a stream of scans needs rig.lidar, and this rig has None")
        self._reader, self._sweep = ScanReader(rig.lidar), Sweep(rig.lidar)
        self._dt = rig.dt
        self._stamp: float | None = None
        self._inclination: Inclination | None = None
        if rig.imu is not None and "imu" in observation:
            self._inclination = Inclination(rig.imu, observation)

    def next(self, observation: Observation, increment: Array | None = None) -> Scan | None:
        """The scan that came with an observation, which must be told every one; None where none
        came.

        Args:
            increment: (3,) how the robot moved since the observation before, as far as is known.

        Raises:
            ValueError: the scan is of another lidar.
        """
        motion = self._sweep.motion(float(observation["stamp"][0]), increment)
        if self._inclination is not None:
            self._inclination.follow(observation, increment)
        stamp = stamp_of("lidar", observation)
        if stamp == self._stamp:
            return None
        self._stamp = stamp
        now = float(observation["stamp"][0])
        return self._reader.read(
            observation["lidar"], motion, self._levelling() if now - stamp < self._dt / 2 else None
        )

    def _levelling(self) -> Array | None:
        return None if self._inclination is None else self._inclination.levelling
