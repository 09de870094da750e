"""A recording as an environment: the same observations as a robot's, whatever the action."""

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, ClassVar

import gymnasium as gym
import numpy as np
from gymnasium import spaces
from gymnasium.error import ResetNeeded
from numpy.typing import NDArray

from grouser.envs.recordings.kitti import KittiRecording, open_kitti
from grouser.geometry import Array, project
from grouser.rig import Rig

Observation = dict[str, Any]


class ReplayEnv(gym.Env[Observation, NDArray[np.float32]]):
    """Plays a KITTI-odometry-style folder from its first frame to its last.

    Observations are `left`, `right` (H, W, 1) uint8, or (H, W, 3) with `color=True`, and `stamp`
    (1,) float64 in s since the start. The action is ignored. The episode is truncated with the
    last frame. Where the folder holds poses, info has `true_pose` (3,) and `true_pose_3d` (4, 4),
    the robot's in its frame at the start, for scoring only.
    """

    metadata = {"render_modes": ["rgb_array"], "render_fps": 10}
    SENSORS: ClassVar[tuple[str, ...]] = ("left", "right")

    def __init__(
        self,
        log: str | Path,
        *,
        rig: Mapping[str, Any] | None = None,
        sensors: Iterable[str] | None = None,
        color: bool = False,
        render_mode: str | None = None,
    ) -> None:
        """Open the folder `log`.

        Args:
            log: the folder; envs/recordings/kitti.py says what is in it.
            rig: values that the recording does not say, by dotted name, such as
                {"stereo.T_base_camera": camera_mount(z=1.65).tolist()}; another `dt` stretches
                the stamps.
            sensors: which of `SENSORS` to observe; all when None. `stamp` is always there.
            color: RGB images instead of grey ones.
            render_mode: None, or "rgb_array": `render()` gives the left image.

        Raises:
            FileNotFoundError: the folder or one of its files is missing.
            ValueError: a malformed file, an unknown sensor, rig entry or render mode, or a rig
                that is not of these images.
        """
        self.sensors = _checked_sensors(sensors, self.SENSORS)
        if render_mode not in (None, *self.metadata["render_modes"]):
            raise ValueError(f"render_mode {render_mode!r} is not one of None, 'rgb_array'")
        self.render_mode = render_mode
        self._recording: KittiRecording = open_kitti(log)
        self.rig: Rig = _completed_rig(self._recording, rig or {})
        self._stamps = self._recording.stamps * (self.rig.dt / self._recording.rig.dt)
        self._color = color
        self._base_poses = _base_poses(self._recording.poses, self.rig)
        self._index: int | None = None
        self.observation_space = self._space()
        self.action_space = spaces.Box(-1.0, 1.0, (2,), np.float32)

    @property
    def has_truth(self) -> bool:
        """Whether the recording says where the robot was, and info therefore does."""
        return self._base_poses is not None

    def __len__(self) -> int:
        """Number of frames."""
        return len(self._recording)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Go back to the first frame; the seed changes nothing."""
        super().reset(seed=seed)
        self._index = 0
        return self._observe(0), self._info(0)

    def step(
        self, action: NDArray[np.float32]
    ) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """Go to the next frame.

        Raises:
            ResetNeeded: before `reset`, or after the last frame.
            ValueError: an image that cannot be decoded.
        """
        if self._index is None:
            raise ResetNeeded("the replay has not begun; call reset() before step()")
        if self._index + 1 >= len(self):
            raise ResetNeeded(
                f"the recording has ended: frame {self._index} was its last of {len(self)} and "
                "the episode was truncated; call reset() to play it again"
            )
        self._index += 1
        truncated = self._index + 1 == len(self)
        return self._observe(self._index), 0.0, False, truncated, self._info(self._index)

    def render(self) -> Any:
        """The left image, (H, W, 3) uint8 RGB, with render_mode="rgb_array"."""
        if self.render_mode is None:
            return None
        if self._index is None:
            raise ResetNeeded("there is no frame to render; call reset() first")
        return self._recording.image(self._recording.left[self._index], color=True)

    def _space(self) -> spaces.Dict:
        stereo = self.rig.stereo
        assert stereo is not None
        shape = (stereo.height, stereo.width, 3 if self._color else 1)
        last = float(self._stamps[-1])
        images = {name: spaces.Box(0, 255, shape, np.uint8) for name in self.sensors}
        # Bounds must differ even where there is but one frame.
        stamp = spaces.Box(0.0, max(last, self.rig.dt), (1,), np.float64)
        return spaces.Dict({**images, "stamp": stamp})

    def _observe(self, index: int) -> Observation:
        files = {"left": self._recording.left[index], "right": self._recording.right[index]}
        images = {
            name: self._recording.image(files[name], color=self._color) for name in self.sensors
        }
        return {**images, "stamp": np.array([self._stamps[index]])}

    def _info(self, index: int) -> dict[str, Any]:
        if self._base_poses is None:
            return {}
        T_b0_bk = self._base_poses[index].copy()
        return {"true_pose": project(T_b0_bk), "true_pose_3d": T_b0_bk}


def _checked_sensors(sensors: Iterable[str] | None, known: tuple[str, ...]) -> tuple[str, ...]:
    listed = (sensors,) if isinstance(sensors, str) else known if sensors is None else sensors
    asked = set(listed) - {"stamp"}
    unknown = sorted(asked - set(known))
    if unknown:
        raise ValueError(
            f"the recording has no sensor {', '.join(map(repr, unknown))}; it has: "
            f"{', '.join(known)} (and stamp, always)"
        )
    return tuple(name for name in known if name in asked)


def _completed_rig(recording: KittiRecording, overrides: Mapping[str, Any]) -> Rig:
    """The recording's rig with what it does not say; what its images do say stays."""
    rig, read = recording.rig.with_overrides(overrides), recording.rig.stereo
    assert read is not None
    size, shown = (read.width, read.height), rig.stereo
    if shown is None or (shown.width, shown.height) != size:
        said = "no stereo pair" if shown is None else f"{shown.width} x {shown.height} px"
        raise ValueError(
            f"the overrides leave the rig with {said}, but the recording's images are of a stereo "
            f"pair of {size[0]} x {size[1]} px; override neither `stereo` by None nor its size"
        )
    return rig


def _base_poses(camera_poses: Array | None, rig: Rig) -> Array | None:
    """T_b0_bk (N, 4, 4) from T_c0_ck: the robot's motion, not that of the camera on it."""
    if camera_poses is None:
        return None
    assert rig.stereo is not None
    T_base_camera, T_camera_base = rig.stereo.T_base_camera, rig.stereo.T_camera_base
    T_b0_bk: Array = T_base_camera @ camera_poses @ T_camera_base
    return T_b0_bk
