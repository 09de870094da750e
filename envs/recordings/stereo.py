"""A KITTI-odometry-style folder as a recording that can be played."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from grouser.envs.recordings.kitti import KittiRecording, open_kitti
from grouser.envs.recordings.recording import Recording
from grouser.geometry import Array
from grouser.rig import Rig


class StereoRecording(Recording):
    """Rectified stereo images, decoded as they are read."""

    sensors = ("left", "right")

    def __init__(self, folder: str | Path) -> None:
        """Raises:
        FileNotFoundError: the folder or one of its files is missing.
        ValueError: a malformed file, named with its line.
        """
        self._kitti: KittiRecording = open_kitti(folder)
        self.rig: Rig = self._kitti.rig
        self.stamps: Array = self._kitti.stamps
        self.increments: Mapping[str, Array] = {}

    def check(self, rig: Rig) -> None:
        read, shown = self.rig.stereo, rig.stereo
        assert read is not None
        size = (read.width, read.height)
        if shown is None or (shown.width, shown.height) != size:
            said = "no stereo pair" if shown is None else f"{shown.width} x {shown.height} px"
            raise ValueError(
                f"the overrides leave the rig with {said}, but the recording's images are of a "
                f"stereo pair of {size[0]} x {size[1]} px; override neither `stereo` by None nor "
                "its size"
            )

    def space(self, name: str, rig: Rig, *, color: bool) -> spaces.Box:
        assert rig.stereo is not None
        return spaces.Box(
            0, 255, (rig.stereo.height, rig.stereo.width, 3 if color else 1), np.uint8
        )

    def read(self, name: str, index: int, rig: Rig, *, color: bool) -> NDArray[Any]:
        files = self._kitti.left if name == "left" else self._kitti.right
        return self._kitti.image(files[index], color=color)

    def base_poses(self, rig: Rig) -> Array | None:
        """T_b0_bk from T_c0_ck: the robot's motion, not that of the camera on it."""
        if self._kitti.poses is None:
            return None
        assert rig.stereo is not None
        T_b0_bk: Array = rig.stereo.T_base_camera @ self._kitti.poses @ rig.stereo.T_camera_base
        return T_b0_bk

    def picture(self, index: int, rig: Rig) -> NDArray[np.uint8]:
        """The left image."""
        return self._kitti.image(self._kitti.left[index], color=True)
