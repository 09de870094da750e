"""KITTI-odometry-style folders of rectified stereo: checked when opened, decoded as they are read.

image_l | image_2 | image_0    left images, PNG, in the order of their names
image_r | image_3 | image_1    right images, with the same names
calib.txt                      3 x 4 projections, one row a camera
poses.txt                      optional: 3 x 4 pose of camera 0 a frame (12 numbers a line)
times.txt                      optional: seconds, one number a line; else 10 frames a second
"""

from collections.abc import Mapping, Sized
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from grouser.envs.recordings.kitti_calibration import read_calibration, write_calibration
from grouser.geometry import Array, inverse_transform
from grouser.rig import Rig
from grouser.text_table import read_rows
from grouser.trajectory import read_kitti, write_kitti

Image = NDArray[np.uint8]

# Folder names of a pair, and the numbers that calib.txt knows its cameras by.
_PAIRS = (
    ("image_l", "image_r", (0, 1)),
    ("image_2", "image_3", (2, 3)),
    ("image_0", "image_1", (0, 1)),
)
_DEFAULT_DT = 0.1
_PNG_SIGNATURE = b"\x89PNG\r\n\x1a\n"


class DamagedImage(ValueError):
    """An image that cannot be decoded, or not as the others; found only when it is its turn."""


@dataclass(frozen=True, slots=True, eq=False)
class KittiRecording:
    """A folder whose files were found to be complete and consistent."""

    left: tuple[Path, ...]
    right: tuple[Path, ...]
    stamps: Array
    """(N,) s, from zero."""
    rig: Rig
    """Step and stereo pair; the mount, which no file tells, is level at the robot's origin."""
    poses: Array | None
    """(N, 4, 4) T_start_k of the left camera in its own frame at the start, where known."""

    def __len__(self) -> int:
        return len(self.left)

    def image(self, path: Path, *, color: bool) -> Image:
        """Decode one image: (H, W, 1) grey, or (H, W, 3) RGB.

        Raises:
            DamagedImage: it cannot be decoded, or its size is not that of the first one.
        """
        decoded = cv2.imread(str(path), cv2.IMREAD_COLOR if color else cv2.IMREAD_GRAYSCALE)
        if decoded is None:
            raise DamagedImage(f"{path} cannot be decoded as an image: the file is damaged")
        stereo = self.rig.stereo
        assert stereo is not None
        _check_size(path, (decoded.shape[1], decoded.shape[0]), (stereo.width, stereo.height))
        image = decoded[:, :, ::-1] if color else decoded[:, :, None]
        return np.ascontiguousarray(image, dtype=np.uint8)


def open_kitti(folder: str | Path) -> KittiRecording:
    """Open a folder and check everything but the pixels.

    Raises:
        FileNotFoundError: the folder, an image or the calibration is missing.
        ValueError: an image that is no PNG or of another size, a short or malformed calibration,
            or poses or times that are malformed or of the wrong length; with file and line.
    """
    root = Path(folder)
    if not root.is_dir():
        raise FileNotFoundError(f"{root} is missing or is not a folder")
    left_folder, right_folder, cameras = _find_pair(root)
    left, right = _list_pair(left_folder, right_folder)
    size = _common_size([*left, *right])
    calibration = read_calibration(root / "calib.txt", cameras)
    stamps, dt = _read_stamps(root / "times.txt", left)
    poses = _read_poses(root / "poses.txt", left)
    if poses is not None:
        poses = _of_left_camera(poses, calibration.T_left_reference)
    return KittiRecording(left, right, stamps, Rig(dt=dt, stereo=calibration.camera(*size)), poses)


def write_kitti_recording(
    folder: str | Path,
    rig: Rig,
    left: list[Image],
    right: list[Image],
    *,
    poses: Array | None = None,
    stamps: Array | None = None,
) -> None:
    """Write stereo images (H, W) or (H, W, 1 or 3; RGB) as a folder that `open_kitti` reads.

    Poses (N, 4, 4) are those of the left camera; stamps (N,) are seconds, every `rig.dt` if None.

    Raises:
        ValueError: the rig has no stereo pair, or there are not as many of one thing as of another.
        OSError: an image cannot be written.
    """
    if rig.stereo is None:
        raise ValueError("a stereo recording needs a rig with a stereo pair; this one has none")
    times = rig.dt * np.arange(len(left), dtype=np.float64) if stamps is None else stamps
    _check_one_a_frame({"left": left, "right": right, "stamps": times, "poses": poses})
    root = Path(folder)
    for name, images in (("image_l", left), ("image_r", right)):
        (root / name).mkdir(parents=True, exist_ok=True)
        for index, image in enumerate(images):
            bgr = image[:, :, ::-1] if image.ndim == 3 and image.shape[2] == 3 else image
            path = root / name / f"{index:06d}.png"
            if not cv2.imwrite(str(path), bgr):
                raise OSError(f"{path} cannot be written: is the disk full, or the folder closed?")
    write_calibration(root / "calib.txt", rig.stereo)
    if poses is not None:
        write_kitti(root / "poses.txt", poses)
    np.savetxt(root / "times.txt", times, fmt="%.9f")


def _check_one_a_frame(parts: Mapping[str, Sized | None]) -> None:
    counts = {name: len(part) for name, part in parts.items() if part is not None}
    if len(set(counts.values())) > 1:
        found = ", ".join(f"{count} of {name}" for name, count in counts.items())
        raise ValueError(f"a recording has one of each a frame, but got {found}")


def _find_pair(root: Path) -> tuple[Path, Path, tuple[int, int]]:
    for left, right, cameras in _PAIRS:
        if (root / left).is_dir():
            if not (root / right).is_dir():
                raise FileNotFoundError(f"{root / right} is missing, the right images of {left}")
            return root / left, root / right, cameras
    names = ", ".join(f"{left} with {right}" for left, right, _ in _PAIRS)
    raise FileNotFoundError(f"{root} holds no folder of left images; expected {names}")


def _list_pair(left: Path, right: Path) -> tuple[tuple[Path, ...], tuple[Path, ...]]:
    names = sorted((path.name for path in left.glob("*.png")), key=_order)
    if not names:
        raise FileNotFoundError(f"{left} holds no PNG image")
    if len(names) == 1:
        raise ValueError(f"{left} holds a single image; a recording needs two frames at least")
    _check_no_gap(left, names)
    right_names = {path.name for path in right.glob("*.png")}
    for folder, other, lacking in (
        (right, left, sorted(set(names) - right_names)),
        (left, right, sorted(right_names - set(names))),
    ):
        if lacking:
            raise FileNotFoundError(
                f"{folder / lacking[0]} is missing, but {other / lacking[0]} is there: "
                f"{left.name} holds {len(names)} images, {right.name} holds {len(right_names)}"
            )
    return tuple(left / name for name in names), tuple(right / name for name in names)


def _order(name: str) -> tuple[int, str]:
    """By number, so that 10.png comes after 9.png; what has none comes first, by name."""
    stem = Path(name).stem
    return (int(stem) if stem.isdigit() else -1, name)


def _check_no_gap(folder: Path, names: list[str]) -> None:
    """Frames that are numbered must follow each other, or the motion between them is a jump."""
    stems = [Path(name).stem for name in names]
    if not all(stem.isdigit() for stem in stems):
        return
    for stem, following in zip(stems, stems[1:], strict=False):
        expected = str(int(stem) + 1).zfill(len(stem))
        if int(following) != int(expected):
            raise FileNotFoundError(f"{folder / expected}.png is missing between its neighbours")


def _common_size(paths: list[Path]) -> tuple[int, int]:
    first = _png_size(paths[0])
    for path in paths[1:]:
        _check_size(path, _png_size(path), first)
    return first


def _check_size(path: Path, size: tuple[int, int], expected: tuple[int, int]) -> None:
    if size != expected:
        raise DamagedImage(
            f"{path} is {size[0]} x {size[1]} px, but the first image is "
            f"{expected[0]} x {expected[1]} px; all must have one size"
        )


def _png_size(path: Path) -> tuple[int, int]:
    """(width, height) from the header: a sequence of thousands is checked in a blink."""
    with path.open("rb") as file:
        header = file.read(24)
    if len(header) < 24 or not header.startswith(_PNG_SIGNATURE):
        raise ValueError(f"{path} is not a PNG image, or is cut short")
    return int.from_bytes(header[16:20], "big"), int.from_bytes(header[20:24], "big")


def _read_stamps(path: Path, images: tuple[Path, ...]) -> tuple[Array, float]:
    """(N,) s from zero, and the step: the median where they are recorded."""
    if not path.exists():
        return np.arange(len(images), dtype=np.float64) * _DEFAULT_DT, _DEFAULT_DT
    rows, lines = read_rows(path, 1)
    _check_length(path, lines, "times", images)
    steps = np.diff(rows[:, 0])
    for step, line in zip(steps, lines[1:], strict=True):
        if step <= 0:
            raise ValueError(f"{path}:{line}: the time does not grow (by {step:g} s)")
    stamps: Array = rows[:, 0] - rows[0, 0]
    return stamps, float(np.median(steps))


def _read_poses(path: Path, images: tuple[Path, ...]) -> Array | None:
    if not path.exists():
        return None
    poses = read_kitti(path)
    _check_length(path, read_rows(path, 12)[1], "poses", images)
    return poses


def _check_length(path: Path, lines: list[int], what: str, images: tuple[Path, ...]) -> None:
    if len(lines) != len(images):
        raise ValueError(
            f"{path}:{lines[-1]}: the file ends after {len(lines)} {what}, but "
            f"{images[0].parent} holds {len(images)} images"
        )


def _of_left_camera(poses: Array, T_left_reference: Array) -> Array:
    """Poses of camera 0 to those of the left camera, the first being the identity."""
    T_world_left: Array = poses @ inverse_transform(T_left_reference)
    T_start_left: Array = inverse_transform(T_world_left[0]) @ T_world_left
    return T_start_left
