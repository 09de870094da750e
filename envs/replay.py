"""A recording as an environment: the same observations as a robot's, whatever the action."""

import math
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium import spaces
from gymnasium.error import ResetNeeded
from numpy.typing import NDArray

from grouser.envs.recordings.odometry_noise import with_noise
from grouser.envs.recordings.opening import open_recording
from grouser.envs.recordings.recording import Recording
from grouser.geometry import Array, project
from grouser.rig import Rig

Observation = dict[str, Any]


class ReplayEnv(gym.Env[Observation, NDArray[np.float32]]):
    """Plays a recording from its first frame to its last.

    A KITTI-odometry-style folder shows `left`, `right` (H, W, 1) uint8, or (H, W, 3) with
    `color=True`; a CARMEN log shows `lidar` (N,) float32 and `odometry` (3,) float64; a file of
    wheel ticks and scans shows `lidar` and `tracks` (2,) float64; and all `stamp` (1,) float64 in s
    since the start. The action is ignored. The episode is truncated with the last frame. Where
    poses are recorded, info has `true_pose` (3,) and `true_pose_3d` (4, 4), the robot's in its
    frame at the start, for scoring only.
    """

    metadata = {"render_modes": ["rgb_array"], "render_fps": 10}

    def __init__(
        self,
        log: str | Path,
        *,
        rig: Mapping[str, Any] | None = None,
        sensors: Iterable[str] | None = None,
        color: bool = False,
        odometry_noise: float = 0.0,
        render_mode: str | None = None,
    ) -> None:
        """Open the recording `log`.

        Args:
            log: a folder (envs/recordings/kitti.py says what is in it), a CARMEN log (carmen.py)
                or a file of wheel ticks and scans (ticks.py).
            rig: values that the recording does not say, by dotted name, such as
                {"stereo.T_base_camera": camera_mount(z=1.65).tolist()}; another `dt` stretches
                the stamps.
            sensors: which of the recording's to observe; all when None. `stamp` is always there.
            color: RGB images instead of grey ones.
            odometry_noise: white noise to add to `odometry` or `tracks`, one sigma as a share of
                the increment (envs/recordings/odometry_noise.py); the seed of `reset` decides it.
            render_mode: None, or "rgb_array": `render()` gives the left image, or the scan from
                above.

        Raises:
            FileNotFoundError: the recording or one of its files is missing.
            ValueError: a malformed file, with the line; an unknown sensor, rig entry or render
                mode; a rig that is not of this recording; or noise where nothing takes it.
        """
        if render_mode not in (None, *self.metadata["render_modes"]):
            raise ValueError(f"render_mode {render_mode!r} is not one of None, 'rgb_array'")
        self.render_mode = render_mode
        self._recording: Recording = open_recording(log)
        self.sensors = _checked_sensors(sensors, self._recording.sensors)
        self.rig: Rig = self._recording.rig.with_overrides(rig or {})
        self._recording.check(self.rig)
        self._stamps = self._recording.stamps * (self.rig.dt / self._recording.rig.dt)
        self._color = color
        self._noise = _checked_noise(odometry_noise, self._recording)
        self._increments: Mapping[str, Array] = {}
        self._base_poses = self._recording.base_poses(self.rig)
        self._index: int | None = None
        self.observation_space = self._space()
        self.action_space = spaces.Box(-1.0, 1.0, (2,), np.float32)

    @property
    def has_truth(self) -> bool:
        """Whether the recording says where the robot was, and info therefore does."""
        return self._base_poses is not None

    @property
    def recorded(self) -> tuple[str, ...]:
        """All sensors that the recording has, beside `stamp`."""
        return self._recording.sensors

    def __len__(self) -> int:
        """Number of frames."""
        return len(self._recording)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Go back to the first frame; the seed changes nothing but the odometry's noise."""
        super().reset(seed=seed)
        self._index = 0
        if self._noise > 0:
            self._increments = {
                name: with_noise(name, clean, self._noise, self.np_random)
                for name, clean in self._recording.increments.items()
            }
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
        """(H, W, 3) uint8 RGB with render_mode="rgb_array": the left image, or the scan."""
        if self.render_mode is None:
            return None
        if self._index is None:
            raise ResetNeeded("there is no frame to render; call reset() first")
        return self._recording.picture(self._index, self.rig)

    def _space(self) -> spaces.Dict:
        shown: dict[str, spaces.Space[Any]] = {
            name: self._recording.space(name, self.rig, color=self._color) for name in self.sensors
        }
        # Bounds must differ even where there is but one frame.
        last = max(float(self._stamps[-1]), self.rig.dt)
        return spaces.Dict({**shown, "stamp": spaces.Box(0.0, last, (1,), np.float64)})

    def _observe(self, index: int) -> Observation:
        shown = {name: self._read(name, index) for name in self.sensors}
        return {**shown, "stamp": np.array([self._stamps[index]])}

    def _read(self, name: str, index: int) -> NDArray[Any]:
        if name in self._increments:
            increment: NDArray[Any] = self._increments[name][index].copy()
            return increment
        return self._recording.read(name, index, self.rig, color=self._color)

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


def _checked_noise(share: float, recording: Recording) -> float:
    if not (math.isfinite(share) and share >= 0):
        raise ValueError(f"odometry_noise must be a share of zero or more, got {share}")
    if share > 0 and not recording.increments:
        raise ValueError(
            "odometry_noise has nothing to act on: the recording has neither odometry nor tracks, "
            f"only {', '.join(recording.sensors)}"
        )
    return share
