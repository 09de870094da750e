"""A lidar scan as beams in the robot's frame, as if all had been sent with the last one."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from grouser.geometry import Array, exp, log, rotate
from grouser.kernels import kernel
from grouser.rig import Lidar

_ROUNDING = 1e-6  # of the least and the longest range: readings are float32
_CLEARANCE = 0.05
"""m above the floor on which the robot stands: what a tilted beam meets there may be the floor"""


@dataclass(frozen=True, slots=True, eq=False)
class Scan:
    """n beams, counter-clockwise around the robot, on its plane."""

    ranges: Array
    """(n,) m along the beam; inf where it met nothing, NaN where nothing is known."""
    origins: Array
    """(n, 2) where each was sent from, m."""
    directions: Array
    """(n, 2) what a metre along the beam is on the plane: of length 1 unless the lidar tilts."""
    turns: Array
    """(n, 2) derivative of the direction by the bearing."""

    @property
    def hit(self) -> NDArray[np.bool_]:
        """(n,) which met something."""
        return np.asarray(np.isfinite(self.ranges))

    @property
    def points(self) -> Array:
        """(m, 2) what they met, m."""
        hit = self.hit
        return self.origins[hit] + self.ranges[hit, None] * self.directions[hit]


class ScanReader:
    """Reads the scans of one lidar."""

    def __init__(self, lidar: Lidar) -> None:
        self._lidar = lidar
        # A lidar that is mounted upside down scans clockwise.
        R = lidar.T_base_lidar[:2, :2]
        step = lidar.angle_increment * np.linalg.det(R)
        self._order = slice(None) if step >= 0 else slice(None, None, -1)
        bearings = lidar.bearings[self._order]
        c, s = np.cos(bearings), np.sin(bearings)
        self._cosines = np.stack([c, s], axis=-1)
        self._turning = np.sign(step) * np.stack([-s, c], axis=-1)
        self._directions, self._turns = self._cosines @ R.T, self._turning @ R.T
        self._origins = np.tile(lidar.T_base_lidar[:2, 3], (lidar.n_beams, 1))
        self.increment = abs(lidar.angle_increment)
        """rad between two beams"""
        seam = 2 * np.pi - (lidar.n_beams - 1) * self.increment
        self.full_turn = bool(seam < 1.5 * self.increment)
        """Whether the beam after the last one is the first."""

    def read(
        self,
        ranges: ArrayLike,
        motion: Array | None = None,
        levelling: Array | None = None,
    ) -> Scan:
        """The beams of a scan.

        Args:
            ranges: (n,) m, in the order of the lidar's bearings; at `range_max` or infinite where
                nothing was met. What is NaN, or not above `range_min`, says nothing.
            motion: (3,) x, y [m], heading [rad] of the robot as the last beam was sent, seen from
                where it was for the first one; beams move with the robot, at a constant twist.
                Left out, it stood still.
            levelling: (3, 3) as `Inclination` has it: the beams are those in the level plane, and
                what is met near the floor on which the robot stands says nothing. Left out, the
                robot stands level.

        Raises:
            ValueError: there is not one range for each beam of the lidar.
        """
        told = np.array(ranges, dtype=np.float64)
        if told.shape != (self._lidar.n_beams,):
            raise ValueError(
                f"a scan of this lidar must have {self._lidar.n_beams} ranges, one a beam, got an "
                f"array of shape {told.shape}"
            )
        far = told >= self._lidar.range_max * (1 - _ROUNDING)
        told[~(told > self._lidar.range_min * (1 + _ROUNDING))] = np.nan
        told[far] = np.inf
        told = told[self._order]
        scan = Scan(told, self._origins, self._directions, self._turns)
        if levelling is not None:
            scan = self._levelled(told, levelling)
        return scan if motion is None else self._straightened(scan, motion)

    def _levelled(self, ranges: Array, R: Array) -> Scan:
        """Seen from above; without the floor, in place."""
        T = self._lidar.T_base_lidar
        # Elsewhere nobody said how high the lidar is.
        lowest = min(_CLEARANCE, T[2, 3] / 4) if T[2, 3] > 0 else -np.inf
        origin = R @ T[:3, 3]
        directions, turns = np.empty_like(self._directions), np.empty_like(self._turns)
        beams = self._cosines, self._turning, R @ T[:3, :2]
        _level(ranges, *beams, float(origin[2]), lowest, directions, turns)
        return Scan(ranges, np.tile(origin[:2], (len(ranges), 1)), directions, turns)

    def _straightened(self, scan: Scan, motion: Array) -> Scan:
        """Each beam from where the robot was when it sent it, in the frame of the last beam."""
        n = self._lidar.n_beams
        to_come = np.linspace(1.0, 0.0, n)[self._order]
        poses = exp(-to_come[:, None] * log(motion))
        heading = poses[:, 2]
        return Scan(
            scan.ranges,
            poses[:, :2] + rotate(heading, scan.origins),
            rotate(heading, scan.directions),
            rotate(heading, scan.turns),
        )


class Sweep:
    """How the robot moved while its lidar took a scan, from how it moved between observations."""

    def __init__(self, lidar: Lidar) -> None:
        self._duration = lidar.sweep_time
        self._stamp: float | None = None

    def motion(self, stamp: float, increment: Array | None) -> Array | None:
        """(3,) for `ScanReader.read`: the same twist, for as long as a scan takes.

        Args:
            stamp: s, of this observation.
            increment: (3,) how the robot moved since the observation before; None where that is
                not known, so that it counts as standing still.
        """
        before, self._stamp = self._stamp, stamp
        if self._duration == 0 or increment is None or before is None or stamp <= before:
            return None
        return exp(self._duration / (stamp - before) * log(increment))


@kernel
def _level(
    ranges: Array,
    cosines: Array,
    turning: Array,
    mount: Array,
    height: float,
    lowest: float,
    directions: Array,
    turns: Array,
) -> None:
    """Write what a metre of each beam is on the plane, and its derivative by the bearing; what it
    met below the lowest height of a wall is not known any more.

    Args:
        cosines, turning: (n, 2) the beams in the lidar's plane, and their derivatives.
        mount: (3, 2) the axes of that plane.
        height: of the lidar, m.
    """
    for i in range(len(ranges)):
        for k in range(2):
            directions[i, k] = mount[k, 0] * cosines[i, 0] + mount[k, 1] * cosines[i, 1]
            turns[i, k] = mount[k, 0] * turning[i, 0] + mount[k, 1] * turning[i, 1]
        rise = mount[2, 0] * cosines[i, 0] + mount[2, 1] * cosines[i, 1]
        if np.isfinite(ranges[i]) and height + ranges[i] * rise < lowest:
            ranges[i] = np.nan
