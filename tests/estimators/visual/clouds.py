"""Clouds of points before a stereo camera, moved by plain SE(3) in metres: the tests' own oracle.

Nothing here uses the disparity-space algebra under test.
"""

from math import radians

import numpy as np

from grouser.estimators.visual.matching import Matches
from grouser.estimators.visual.prior import MotionPrior
from grouser.geometry import Array, inverse_transform, rotate, rotation_from_rpy, transform
from grouser.rig import StereoCamera, camera_mount

LEVEL = camera_mount(0.0, 0.0, 0.4)
MOUNTS = {
    "level on the centre line": LEVEL,
    "ahead and to the left": camera_mount(0.2, 0.1, 0.4),
    "behind and to the right": camera_mount(-0.15, -0.1, 0.4),
    "tilted by 20 degrees": camera_mount(0.2, 0.1, 0.4, pitch=radians(20)),
    "rolled by 5 degrees": camera_mount(0.1, -0.1, 0.4, roll=radians(5)),
    "yawed by 3 degrees": camera_mount(0.1, 0.05, 0.4, yaw=radians(3)),
    "everything": camera_mount(0.2, -0.1, 0.4, roll=radians(5), pitch=radians(20), yaw=radians(3)),
}
MOTIONS = {  # turn [rad], chord [m]
    "arc": (0.06, 0.12),
    "wide arc": (-0.4, 0.5),
    "straight": (0.0, 0.1),
    "reverse": (0.05, -0.15),
    "spot turn": (0.2, 0.0),
    "rest": (0.0, 0.0),
}


def stereo(T_base_camera: Array = LEVEL, *, fx: float = 260.0, fy: float = 260.0) -> StereoCamera:
    """The camera of SPEC 1.7."""
    return StereoCamera(
        fx=fx,
        fy=fy,
        cx=159.5,
        cy=119.5,
        baseline=0.12,
        width=320,
        height=240,
        T_base_camera=T_base_camera,
    )


def scattered(
    rng: np.random.Generator, n: int, camera: StereoCamera, *, depth: tuple[float, float] = (0.8, 9)
) -> Array:
    """Points (n, 3) [m] in the camera's frame, uniform over the image and in log depth."""
    u, v = rng.uniform(0, camera.width, n), rng.uniform(0, camera.height, n)
    z = np.exp(rng.uniform(np.log(depth[0]), np.log(depth[1]), n))
    rays = np.stack([(u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy, np.ones(n)], axis=-1)
    return np.asarray(rays * z[:, None])


def seen(points: Array, camera: StereoCamera) -> Array:
    """u, v, d (..., 3) [px]: as the left eye and the right one, a baseline beside it, see them."""
    x, y, z = points[..., 0], points[..., 1], points[..., 2]
    u = camera.fx * x / z + camera.cx
    u_right = camera.fx * (x - camera.baseline) / z + camera.cx
    return np.stack([u, camera.fy * y / z + camera.cy, u - u_right], axis=-1)


def points_of(w: Array, camera: StereoCamera) -> Array:
    """The points (..., 3) [m] that are seen at w (..., 3); the inverse of `seen`."""
    z = camera.fx * camera.baseline / w[..., 2]
    x, y = (w[..., 0] - camera.cx) / camera.fx, (w[..., 1] - camera.cy) / camera.fy
    return np.asarray(np.stack([x * z, y * z, z], axis=-1))


def six(turn: float, chord: float, *rest: float) -> Array:
    """(6,) motion: side, height, roll and pitch are zero unless given."""
    return np.array([turn, chord, *rest, *np.zeros(4 - len(rest))])


def near_zero(
    side: float, height: float, roll: float, pitch: float, *, vague: float = 1.0
) -> MotionPrior:
    """A prior about no motion with these sigmas; turn and chord [rad, m] are vague."""
    return MotionPrior(np.zeros(6), np.array([vague, 10 * vague, side, height, roll, pitch]))


def chassis(motion: Array) -> Array:
    """T_reference_current (4, 4) of the chassis after a motion (6,)."""
    turn, chord, side, height, roll, pitch = motion
    place = np.append(rotate(turn / 2, [chord, side]), height)
    return transform(rotation_from_rpy(roll, pitch, turn), place)


def moved(points: Array, motion: Array, T_base_camera: Array) -> Array:
    """Points (n, 3) of the reference camera's frame in that of the current camera."""
    T_reference_current = chassis(motion)
    T_camera_now_before = (
        inverse_transform(T_base_camera) @ inverse_transform(T_reference_current) @ T_base_camera
    )
    return np.asarray(points @ T_camera_now_before[:3, :3].T + T_camera_now_before[:3, 3])


def matched(
    rng: np.random.Generator,
    camera: StereoCamera,
    motion: Array,
    *,
    n: int = 64,
    noise: Array | None = None,
    outliers: int = 0,
    depth: tuple[float, float] = (0.8, 9.0),
) -> Matches:
    """A cloud seen before and after a motion, the first `outliers` matches wrong by up to 20 px.

    noise: (6,) variances of u, v, d in the two frames [px^2]; without it the matches are exact,
    and are said to be good to 0.3 px.
    """
    points = scattered(rng, n, camera, depth=depth)
    reference = seen(points, camera)
    current = seen(moved(points, motion, camera.T_base_camera), camera)
    if noise is not None:
        reference = reference + rng.normal(size=(n, 3)) * np.sqrt(noise[:3])
        current = current + rng.normal(size=(n, 3)) * np.sqrt(noise[3:])
    current[:outliers] += rng.uniform(-20, 20, (outliers, 3))
    said = np.full(6, 0.3**2) if noise is None else noise
    return Matches(reference, current, np.tile(said, (n, 1)), n)
