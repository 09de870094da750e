"""The calibration of a KITTI-odometry-style folder: `calib.txt` to a rectified stereo pair."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from grouser.geometry import Array, transform
from grouser.rig import StereoCamera, camera_mount
from grouser.text_table import parse_row, read_text

# What a recording does not say of its mount, as one sigma: x, y, z [m], roll, pitch, yaw [rad].
# Wide enough for a camera anywhere on a car; heights and rolls are kept better than that.
UNKNOWN_MOUNT_SIGMA = np.array([1.5, 0.5, 1.0, 0.02, 0.05, 0.02])
UNKNOWN_MOUNT_SIGMA.setflags(write=False)

# px. Nor of its rectification; a tenth of a pixel is a third of a percent of all distances.
UNKNOWN_DISPARITY_SIGMA = 0.1


@dataclass(frozen=True, slots=True)
class Projection:
    """A row of calib.txt: P (3, 4), pixels of a point in the reference camera's frame."""

    matrix: Array
    place: str
    """"file:line", for errors."""


@dataclass(frozen=True, slots=True)
class StereoCalibration:
    """What calib.txt says of a rectified pair."""

    fx: float
    fy: float
    cx: float
    cy: float
    baseline: float
    """m"""
    disparity_offset: float
    """px: a point at infinity has this disparity, for the principal points differ by it."""
    T_left_reference: Array
    """(4, 4) the camera that poses.txt is of (camera 0), in the left camera's frame."""

    def camera(self, width: int, height: int) -> StereoCamera:
        """The pair as a part of a rig, at the robot's origin and level for want of better."""
        return StereoCamera(
            fx=self.fx,
            fy=self.fy,
            cx=self.cx,
            cy=self.cy,
            baseline=self.baseline,
            width=width,
            height=height,
            T_base_camera=camera_mount(),
            mount_sigma=UNKNOWN_MOUNT_SIGMA,
            disparity_offset=self.disparity_offset,
            disparity_sigma=UNKNOWN_DISPARITY_SIGMA,
        )


def read_calibration(path: Path, cameras: tuple[int, int]) -> StereoCalibration:
    """Read the projections of two cameras, KITTI's numbers 0 and 1 (grey) or 2 and 3 (colour).

    Rows are `P0: 12 numbers` and so on, or 12 numbers without a name in that order. A file of two
    nameless rows is of the one pair that there is, whatever its number.

    Raises:
        FileNotFoundError: there is no such file.
        ValueError: a missing or malformed row, or a pair that is not rectified; file and line.
    """
    named = _projections(path)
    if list(named) == ["0", "1"]:
        cameras = (0, 1)
    left, right = (_find(named, str(camera), path) for camera in cameras)
    _check_rectified(left, right)
    P, Q = left.matrix, right.matrix
    fx, fy, cx, cy = P[0, 0], P[1, 1], P[0, 2], P[1, 2]
    baseline = (P[0, 3] - Q[0, 3]) / fx
    if baseline <= 0:
        raise ValueError(
            f"{right.place}: the baseline (P_left[0,3] - P_right[0,3]) / fx is {baseline:.4g} m; "
            "it must be positive: are the left and the right row swapped?"
        )
    # P = K [I | t], and p_left = p_reference + t.
    t = np.linalg.solve(P[:, :3], P[:, 3])
    return StereoCalibration(
        float(fx),
        float(fy),
        float(cx),
        float(cy),
        float(baseline),
        float(cx - Q[0, 2]),
        transform(np.eye(3), t),
    )


def write_calibration(path: Path, stereo: StereoCamera) -> None:
    """Write `calib.txt` for a stereo pair, the left camera being the reference."""
    P = np.zeros((3, 4))
    P[0, 0], P[1, 1], P[2, 2] = stereo.fx, stereo.fy, 1.0
    P[0, 2], P[1, 2] = stereo.cx, stereo.cy
    Q = P.copy()
    Q[0, 2] -= stereo.disparity_offset
    Q[0, 3] = -stereo.baseline * stereo.fx
    rows = [" ".join(f"{value:.12e}" for value in M.ravel()) for M in (P, Q)]
    path.write_text("".join(f"P{i}: {row}\n" for i, row in enumerate(rows)))


def _projections(path: Path) -> dict[str, Projection]:
    """Rows that are projections, by the number of their camera; other named rows (Tr:) are not."""
    found: dict[str, Projection] = {}
    for number, line in enumerate(read_text(path).splitlines(), start=1):
        words = line.split()
        if not words:
            continue
        if words[0].endswith(":"):
            name, words = words[0][:-1], words[1:]
            if not (name.startswith("P") and name[1:].isdigit()):
                continue
            camera = name[1:]
        else:
            camera = str(len(found))
        place = f"{path}:{number}"
        matrix = np.array(parse_row(words, (12,), place)).reshape(3, 4)
        found[camera] = Projection(matrix, place)
    return found


def _find(named: dict[str, Projection], camera: str, path: Path) -> Projection:
    if camera not in named:
        end = len(read_text(path).splitlines())
        raise ValueError(
            f"{path}:{end}: the file ends without the projection P{camera} (12 numbers, one row "
            f"a camera); it has {', '.join('P' + name for name in named) or 'none'}"
        )
    return named[camera]


def _check_rectified(left: Projection, right: Projection) -> None:
    for P in (left, right):
        K = P.matrix[:, :3]
        if not (np.allclose(K[2], [0, 0, 1]) and K[0, 1] == 0 and K[1, 0] == 0):
            raise ValueError(
                f"{P.place}: not the projection of a rectified camera: expected "
                "fx 0 cx . 0 fy cy . 0 0 1 ."
            )
        if K[0, 0] <= 0 or K[1, 1] <= 0:
            raise ValueError(f"{P.place}: the focal lengths must be positive")
    # Only the principal points' x may differ: a row of the left image is a row of the right one.
    same = [(0, 0), (1, 1), (1, 2)]
    if not all(np.isclose(left.matrix[ij], right.matrix[ij]) for ij in same):
        raise ValueError(
            f"{right.place}: not rectified with {left.place}: fx, fy and cy must be the same"
        )
