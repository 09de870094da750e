"""A small recording of a textured wall, seen from a robot that drives toward it."""

from pathlib import Path

import cv2
import numpy as np
import pytest

from grouser.envs.recordings.kitti import Image, write_kitti_recording
from grouser.geometry import transform
from grouser.rig import Rig, StereoCamera, camera_mount

FRAMES = 16
_WALL_DISTANCE, _STEP, _PX_PER_M = 6.0, 0.08, 150.0
_STEREO = StereoCamera(
    fx=260.0,
    fy=260.0,
    cx=159.5,
    cy=119.5,
    baseline=0.12,
    width=320,
    height=240,
    T_base_camera=camera_mount(),
)


def _texture() -> Image:
    """Twelve metres of wall, rich in corners of several sizes."""
    rng = np.random.default_rng(0)
    sum_ = np.zeros((1800, 1800), np.float32)
    for cells in (60, 150, 450):
        noise = rng.uniform(0, 80, (cells, cells)).astype(np.float32)
        sum_ += cv2.resize(noise, (1800, 1800), interpolation=cv2.INTER_NEAREST)
    return np.asarray(cv2.GaussianBlur(sum_, (5, 5), 0.8).clip(0, 255), np.uint8)


def _view(texture: Image, depth: float, x: float) -> Image:
    """What a camera sees that is `x` to the right and `depth` before the wall."""
    scale = _STEREO.fx / (depth * _PX_PER_M)
    middle = texture.shape[0] / 2
    shift_x = _STEREO.cx - scale * middle - _STEREO.fx * x / depth
    shift_y = _STEREO.cy - scale * middle
    warp = np.array([[scale, 0.0, shift_x], [0.0, scale, shift_y]])
    size = (_STEREO.width, _STEREO.height)
    return np.asarray(cv2.warpAffine(texture, warp, size, flags=cv2.INTER_AREA), np.uint8)


@pytest.fixture(scope="session")
def wall_log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("logs") / "wall"
    texture = _texture()
    depths = _WALL_DISTANCE - _STEP * np.arange(FRAMES)
    left = [_view(texture, depth, 0.0) for depth in depths]
    right = [_view(texture, depth, _STEREO.baseline) for depth in depths]
    ahead = np.array([[0.0, 0.0, _STEP * k] for k in range(FRAMES)])
    poses = transform(np.eye(3), ahead)
    write_kitti_recording(folder, Rig(dt=0.1, stereo=_STEREO), left, right, poses=poses)
    return folder
