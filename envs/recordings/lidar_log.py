"""Scans of a planar lidar with the motion between them: what logs of robots in buildings hold."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from grouser.envs.recordings.recording import Recording
from grouser.geometry import Array, between, compose, lift, project
from grouser.rig import Lidar, Rig

_PICTURE_PX = 480


class LidarLog(Recording):
    """A log that was read as a whole; ranges are cut at the rig's `lidar.range_max` when shown."""

    def __init__(
        self,
        rig: Rig,
        stamps: Array,
        scans: NDArray[np.float32],
        increments: Mapping[str, Array],
        poses: Array | None,
    ) -> None:
        """
        Args:
            rig: with a lidar, and a part of the name of each of `increments`.
            stamps: (N,) s, from zero, growing.
            scans: (N, n_beams) m; infinite, or beyond `lidar.range_max`, where nothing was hit.
            increments: (N, k) by observation key.
            poses: (N, 3) of the robot in any one frame, where they are known.
        """
        self.rig = rig
        self.stamps = stamps
        self.increments = increments
        self.sensors = tuple(sorted(("lidar", *increments)))
        self._scans, self._poses = scans, poses

    def check(self, rig: Rig) -> None:
        read = self._scans.shape[1]
        beams = "no lidar" if rig.lidar is None else f"a lidar of {rig.lidar.n_beams} beams"
        if rig.lidar is None or rig.lidar.n_beams != read:
            raise ValueError(
                f"the overrides leave the rig with {beams}, but the log's scans are of {read} "
                "beams; override neither `lidar` by None nor its n_beams"
            )

    def space(self, name: str, rig: Rig, *, color: bool) -> spaces.Box:
        if name == "lidar":
            lidar = _lidar(rig)
            return spaces.Box(0.0, lidar.range_max, (lidar.n_beams,), np.float32)
        return spaces.Box(-np.inf, np.inf, self.increments[name].shape[1:], np.float64)

    def read(self, name: str, index: int, rig: Rig, *, color: bool) -> NDArray[Any]:
        if name == "lidar":
            scan: NDArray[Any] = np.minimum(self._scans[index], np.float32(_lidar(rig).range_max))
            return scan
        return np.array(self.increments[name][index])

    def base_poses(self, rig: Rig) -> Array | None:
        if self._poses is None:
            return None
        return lift(between(self._poses[0], self._poses))

    def picture(self, index: int, rig: Rig) -> NDArray[np.uint8]:
        """The scan from above, ahead being up, out to where nine in ten returns lie."""
        lidar = _lidar(rig)
        scan = self.read("lidar", index, rig, color=False)
        image = np.full((_PICTURE_PX, _PICTURE_PX, 3), 255, np.uint8)
        hit = scan < lidar.range_max
        if not hit.any():
            return image
        bearings, ranges = lidar.bearings[hit], scan[hit]
        at = np.column_stack([ranges * np.cos(bearings), ranges * np.sin(bearings), 0 * ranges])
        x, y = compose(project(lidar.T_base_lidar), at)[:, :2].T
        px_per_m = _PICTURE_PX / 2 / max(1.1 * float(np.quantile(ranges, 0.9)), 1e-3)
        rows = np.rint(_PICTURE_PX / 2 - px_per_m * x).astype(int)
        columns = np.rint(_PICTURE_PX / 2 - px_per_m * y).astype(int)
        shown = (np.minimum(rows, columns) >= 1) & (np.maximum(rows, columns) < _PICTURE_PX)
        for back in (0, 1):  # two pixels wide
            image[rows[shown] - back, columns[shown] - back] = 0
        return image


def _lidar(rig: Rig) -> Lidar:
    assert rig.lidar is not None
    return rig.lidar


def growing_stamps(recorded: Array) -> tuple[Array, float]:
    """(N,) s from zero and the median step, of stamps [s] in the order of the scans.

    Where a clock was set back, the scans' order counts: such a step takes the median one's time.
    """
    steps = np.diff(recorded)
    forward = steps[steps > 0]
    usual = float(np.median(forward)) if len(forward) else 1.0
    stamps = np.concatenate([[0.0], np.cumsum(np.where(steps > 0, steps, usual))])
    return stamps, usual
