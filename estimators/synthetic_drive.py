"""A short drive through a painted room, made without any simulator.

What `check_pose_estimator` shows to an estimator: every observation key, with a truth known in
closed form. The room is a box, so that one division a pixel finds the wall it sees.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache

import cv2
import numpy as np
from numpy.typing import NDArray

from grouser import geometry
from grouser.estimators.base import Observation
from grouser.estimators.inclination import GRAVITY
from grouser.estimators.track_motion import arc_pose
from grouser.geometry import Array
from grouser.rig import Imu, Lidar, Rig, StereoCamera, TrackGeometry, camera_mount
from grouser.rig_motion import LineSensor, Odometry

RIG = Rig(
    dt=0.1,
    tracks=TrackGeometry(gauge=0.40, width=0.08, effective_width=0.50),
    stereo=StereoCamera(
        fx=260.0,
        fy=260.0,
        cx=159.5,
        cy=119.5,
        baseline=0.12,
        width=320,
        height=240,
        T_base_camera=camera_mount(0.15, 0.0, 0.45, pitch=0.05),
    ),
    lidar=Lidar(
        n_beams=360,
        angle_min=-np.pi,
        angle_increment=np.pi / 180,
        range_min=0.1,
        range_max=30.0,
        sigma_range=0.01,
        sigma_bearing=0.001,
        T_base_lidar=geometry.transform(np.eye(3), [0.1, 0.0, 0.4]),
    ),
    imu=Imu(sigma_acceleration=0.05, sigma_rate=0.002),
    odometry=Odometry(),
    line_sensor=LineSensor(range_max=30.0, sigma_range=0.02, sigma_bearing=0.002, max_lines=4),
)

ROOM_LOW, ROOM_HIGH = np.array([-3.0, -3.5, 0.0]), np.array([6.0, 3.5, 2.4])  # m
SPEED, TURN_RATE = 0.5, 0.15  # m/s, rad/s
_TEXEL = 0.01  # m
_DETAIL = 0.06  # m: paint finer than a pixel's footprint fades, or it would shimmer


@dataclass(frozen=True, slots=True)
class Drive:
    """Observations of a robot that drives an arc, beside the truth."""

    rig: Rig
    observations: tuple[Observation, ...]
    """One a frame, the first at rest at pose zero."""
    truths: tuple[Mapping[str, Array], ...]
    """`true_pose` (3,) and `true_pose_3d` (4, 4) a frame."""
    poses: Array
    """(n, 3) the true poses."""


@cache
def synthetic_drive(*, frames: int, blackout: range, seed: int = 0) -> Drive:
    """The drive, dark for the frames of `blackout`: black images; no lidar return, line or fix."""
    rng = np.random.default_rng(seed)
    texture = _paint(rng)
    step = arc_pose(TURN_RATE * RIG.dt, SPEED * RIG.dt)
    poses = [np.zeros(3)]
    for _ in range(frames - 1):
        poses.append(geometry.compose(poses[-1], step))
    observations = []
    for index, pose in enumerate(poses):
        seen = _observe(pose, index, texture, rng)
        observations.append(seen | _darkness() if index in blackout else seen)
    truths = tuple({"true_pose": pose, "true_pose_3d": geometry.lift(pose)} for pose in poses)
    return Drive(RIG, tuple(observations), truths, np.array(poses))


def _observe(
    pose: Array, index: int, texture: NDArray[np.float32], rng: np.random.Generator
) -> dict[str, NDArray[np.generic]]:
    assert RIG.tracks is not None
    moving = min(index, 1)
    half_turn = TURN_RATE * RIG.dt * RIG.tracks.effective_width / 2
    return {
        "left": _image(pose, 0.0, texture, rng),
        "right": _image(pose, 1.0, texture, rng),
        "tracks": moving * (SPEED * RIG.dt + half_turn * np.array([-1.0, 1.0])),
        "odometry": moving * arc_pose(TURN_RATE * RIG.dt, SPEED * RIG.dt),
        "lidar": _scan(pose, rng),
        "lines": _walls(pose, rng),
        "points": _corners(pose),
        "imu": np.array([0.0, SPEED * TURN_RATE * moving, GRAVITY, 0.0, 0.0, TURN_RATE * moving]),
        "gps": pose[:2] + rng.normal(0.0, 0.02, 2),
        "stamp": np.array([index * RIG.dt]),
    }


def _darkness() -> dict[str, NDArray[np.generic]]:
    assert RIG.stereo is not None and RIG.lidar is not None
    black = np.zeros((RIG.stereo.height, RIG.stereo.width, 1), dtype=np.uint8)
    nothing = np.full(RIG.lidar.n_beams, RIG.lidar.range_max, dtype=np.float32)
    assert RIG.line_sensor is not None
    return {
        "left": black,
        "right": black.copy(),
        "lidar": nothing,
        "gps": np.full(2, np.nan),
        "lines": np.zeros((RIG.line_sensor.max_lines, 4)),
        "points": np.zeros((RIG.line_sensor.max_lines, 2)),
    }


def _paint(rng: np.random.Generator) -> NDArray[np.float32]:
    """(1024, 1024) overlapping rectangles in greys, which tile without a seam that matters."""
    texture = np.full((1024, 1024), 128, dtype=np.float32)
    for _ in range(4000):
        x, y = rng.integers(0, 1024, 2)
        width, height = rng.integers(8, 50, 2)
        texture[y : y + height, x : x + width] = rng.uniform(30, 225)
    return np.asarray(cv2.GaussianBlur(texture, (0, 0), 1.0), dtype=np.float32)


def _image(
    pose: Array, along_baseline: float, texture: NDArray[np.float32], rng: np.random.Generator
) -> NDArray[np.uint8]:
    """(height, width, 1) of the left (0) or right (1) camera."""
    camera = RIG.stereo
    assert camera is not None
    T_world_camera = geometry.lift(pose) @ camera.T_base_camera
    u, v = np.meshgrid(np.arange(camera.width), np.arange(camera.height))
    rays = np.stack([(u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy, np.ones(u.shape)])
    directions = np.einsum("ij,jhw->hwi", T_world_camera[:3, :3], rays)
    origin = (T_world_camera @ [along_baseline * camera.baseline, 0.0, 0.0, 1.0])[:3]
    depth, axis = _hit(origin, directions)
    point = origin + depth[..., None] * directions
    facing = np.abs(np.take_along_axis(directions, axis[..., None], -1)[..., 0])
    footprint = depth / camera.fx * np.linalg.norm(directions, axis=-1) / facing
    contrast = 1 / (1 + (footprint / _DETAIL) ** 2)
    grey = 128 + contrast * (_texture_at(point, axis, texture) - 128)
    noisy = grey + rng.normal(0.0, 1.0, grey.shape)
    return np.asarray(np.clip(np.rint(noisy), 0, 255), dtype=np.uint8)[..., None]


def _texture_at(
    point: Array, axis: NDArray[np.intp], texture: NDArray[np.float32]
) -> NDArray[np.float32]:
    """Grey of the wall across `axis` at `point` (h, w, 3); opposite walls differ by an offset."""
    side = np.take_along_axis(point, axis[..., None], -1)[..., 0]
    first = np.where(axis == 0, point[..., 1], point[..., 0]) + 2.3 * axis
    second = np.where(axis == 2, point[..., 1], point[..., 2]) + 4.1 * (side > 1.0)
    columns, rows = np.mod(first / _TEXEL, 1024), np.mod(second / _TEXEL, 1024)
    sampled = cv2.remap(
        texture,
        columns.astype(np.float32),
        rows.astype(np.float32),
        cv2.INTER_LINEAR,
        borderMode=cv2.BORDER_WRAP,
    )
    return np.asarray(sampled, dtype=np.float32)


def _scan(pose: Array, rng: np.random.Generator) -> NDArray[np.float32]:
    lidar = RIG.lidar
    assert lidar is not None
    T_world_lidar = geometry.lift(pose) @ lidar.T_base_lidar
    bearing = lidar.bearings
    beams = np.stack([np.cos(bearing), np.sin(bearing), np.zeros(lidar.n_beams)], axis=-1)
    ranges, _ = _hit(T_world_lidar[:3, 3], beams @ T_world_lidar[:3, :3].T)
    noisy = ranges + rng.normal(0.0, lidar.sigma_range, lidar.n_beams)
    return np.clip(noisy, lidar.range_min, lidar.range_max).astype(np.float32)


def _walls(pose: Array, rng: np.random.Generator) -> Array:
    """(4, 4) range and bearing of both ends of each wall, counter-clockwise as seen from within."""
    sensor = RIG.line_sensor
    assert sensor is not None
    (x0, y0), (x1, y1) = ROOM_LOW[:2], ROOM_HIGH[:2]
    corners = np.array([[x0, y0], [x1, y0], [x1, y1], [x0, y1]])
    ends = np.stack([corners, np.roll(corners, -1, axis=0)], axis=1)
    seen = geometry.between(pose, np.concatenate([ends, np.zeros((4, 2, 1))], axis=-1))[..., :2]
    ranges = np.linalg.norm(seen, axis=-1) + rng.normal(0.0, sensor.sigma_range, (4, 2))
    bearings = np.arctan2(seen[..., 1], seen[..., 0]) + rng.normal(0, sensor.sigma_bearing, (4, 2))
    return np.stack([ranges, bearings], axis=-1).reshape(4, 4)


def _corners(pose: Array) -> Array:
    """(4, 2) range and bearing of the room's corners, free of noise."""
    (x0, y0), (x1, y1) = ROOM_LOW[:2], ROOM_HIGH[:2]
    corners = np.array([[x0, y0, 0.0], [x1, y0, 0.0], [x1, y1, 0.0], [x0, y1, 0.0]])
    x, y = geometry.between(pose, corners)[:, :2].T
    return np.column_stack([np.hypot(x, y), np.arctan2(y, x)])


def _hit(origin: Array, directions: Array) -> tuple[Array, NDArray[np.intp]]:
    """How many directions (..., 3) lie between a point in the room and the wall, and its axis."""
    wall = np.where(directions > 0, ROOM_HIGH, ROOM_LOW)
    with np.errstate(divide="ignore", invalid="ignore"):
        lengths = np.where(directions == 0, np.inf, (wall - origin) / directions)
    axis = np.argmin(lengths, axis=-1)
    return np.take_along_axis(lengths, axis[..., None], -1)[..., 0], axis
