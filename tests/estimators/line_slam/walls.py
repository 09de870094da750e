"""Walls on a plane and what a lidar sees of them, computed apart from any sensor of ours."""

import numpy as np
from numpy.typing import ArrayLike

from grouser.geometry import Array, rotate, transform
from grouser.rig import Lidar

ROOM = np.array([[-3.0, -2.0], [4.0, -2.0], [4.0, 3.0], [-3.0, 3.0]])
"""(4, 2) corners, counter-clockwise, m."""


def polygon(corners: ArrayLike) -> Array:
    """(n, 2, 2) walls between corners (n, 2)."""
    corners = np.asarray(corners, dtype=np.float64)
    return np.stack([corners, np.roll(corners, -1, axis=0)], axis=1)


def lidar(
    n_beams: int = 360,
    *,
    fov: float = 2 * np.pi,
    start: float = -np.pi,
    range_max: float = 30.0,
    sigma_range: float = 0.01,
    sigma_bearing: float = 0.001,
    mount: Array | None = None,
) -> Lidar:
    """One that sees `fov` [rad] from the bearing `start` on."""
    return Lidar(
        n_beams=n_beams,
        angle_min=start,
        angle_increment=fov / n_beams,
        range_min=0.05,
        range_max=range_max,
        sigma_range=sigma_range,
        sigma_bearing=sigma_bearing,
        T_base_lidar=np.eye(4) if mount is None else mount,
    )


def mounted(x: float, y: float, yaw: float = 0.0) -> Array:
    """(4, 4) T_base_lidar of a level lidar."""
    c, s = np.cos(yaw), np.sin(yaw)
    return transform([[c, -s, 0], [s, c, 0], [0, 0, 1]], [x, y, 0.3])


def ranges_along(walls: Array, origins: Array, angles: Array) -> Array:
    """(n,) m from origins (n, 2) along angles (n,) [rad] to the nearest of walls (k, 2, 2); inf
    where there is none."""
    d = np.stack([np.cos(angles), np.sin(angles)], axis=-1)[:, None]
    a, along = walls[None, :, 0], walls[None, :, 1] - walls[None, :, 0]
    off = a - origins[:, None]
    cross = d[..., 0] * along[..., 1] - d[..., 1] * along[..., 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        distance = (off[..., 0] * along[..., 1] - off[..., 1] * along[..., 0]) / cross
        share = (off[..., 0] * d[..., 1] - off[..., 1] * d[..., 0]) / cross
    met = (distance > 0) & (share >= -1e-12) & (share <= 1 + 1e-12)
    return np.asarray(np.where(met, distance, np.inf).min(axis=1))


def seen(
    walls: Array,
    sensor: Lidar,
    pose: ArrayLike = (0.0, 0.0, 0.0),
    rng: np.random.Generator | None = None,
) -> Array:
    """(n,) ranges of a robot at a pose (3,), or of poses (n, 3), one a beam; with noise where there
    is a generator."""
    n = sensor.n_beams
    poses = np.broadcast_to(np.asarray(pose, dtype=np.float64), (n, 3))
    T = sensor.T_base_lidar
    yaw = np.arctan2(T[1, 0], T[0, 0])
    noise = np.zeros((2, n)) if rng is None else rng.standard_normal((2, n))
    angles = poses[:, 2] + yaw + sensor.bearings + sensor.sigma_bearing * noise[0]
    origins = poses[:, :2] + rotate(poses[:, 2], np.broadcast_to(T[:2, 3], (n, 2)))
    ranges = ranges_along(walls, origins, angles)
    told = ranges + sensor.sigma_range * noise[1]
    return np.where(ranges < sensor.range_max, told, sensor.range_max)
