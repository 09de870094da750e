"""Points before a stereo camera, moved in metres by plain SE(2), as far as possible from the
disparity-space algebra that is judged on them."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from grouser.estimators.visual.matching import Matches
from grouser.estimators.visual.prior import ChassisPrior, MotionPrior
from grouser.geometry import Array, inverse_transform, rotate, rotation_from_rpy, transform
from grouser.rig import StereoCamera, camera_mount

SIGMA_PX = 0.3
"""Of u, v and u in the right image (SPEC 1.7)."""

_DEPTHS = (0.8, 9.0)  # m
_OUTLIER_PX = 20.0


def spec_camera(forward: float = 0.0) -> StereoCamera:
    """The level camera of SPEC 1.7, so far ahead of the track centre [m]."""
    return StereoCamera(
        fx=260.0,
        fy=260.0,
        cx=159.5,
        cy=119.5,
        baseline=0.12,
        width=320,
        height=240,
        T_base_camera=camera_mount(forward, 0.0, 0.4),
    )


def scattered(rng: np.random.Generator, n: int, camera: StereoCamera) -> Array:
    """Points (n, 3) [m] in the camera's frame, uniform over the image and in log depth."""
    u, v = rng.uniform(0, camera.width, n), rng.uniform(0, camera.height, n)
    nearest, farthest = np.log(_DEPTHS)
    z = np.exp(rng.uniform(nearest, farthest, n))
    return at_pixels(np.stack([u - camera.cx, v - camera.cy], axis=-1), z, camera)


def at_pixels(UV: Array, z: Array, camera: StereoCamera) -> Array:
    """Points (n, 3) [m] seen at U, V (n, 2) [px from the principal point] at depths (n,) [m]."""
    rays = np.column_stack([UV[:, 0] / camera.fx, UV[:, 1] / camera.fy, np.ones(len(z))])
    return np.asarray(rays * z[:, None])


def seen(points: Array, camera: StereoCamera) -> Array:
    """u, v, d (n, 3) [px] of points (n, 3) [m], by the two eyes."""
    x, y, z = points.T
    u, u_right = camera.fx * x / z, camera.fx * (x - camera.baseline) / z
    return np.column_stack([u + camera.cx, camera.fy * y / z + camera.cy, u - u_right])


def moved(points: Array, motion: Array, camera: StereoCamera) -> Array:
    """Points (n, 3) of the reference camera's frame in that of the camera after a motion (6,)."""
    turn, chord, side, height, roll, pitch = motion
    place = np.append(rotate(turn / 2, [chord, side]), height)
    T_before_now = transform(rotation_from_rpy(roll, pitch, turn), place)
    mount = camera.T_base_camera
    T_now_before = inverse_transform(mount) @ inverse_transform(T_before_now) @ mount
    return np.asarray(points @ T_now_before[:3, :3].T + T_now_before[:3, 3])


def planar(turn: float, chord: float, side: float = 0.0) -> Array:
    """(6,) a motion on the plane."""
    return np.array([turn, chord, side, 0.0, 0.0, 0.0])


def noisy(w: Array, rng: np.random.Generator) -> Array:
    """u, v, d (n, 3) with noise on u of either eye, and on v: that of u and of d is correlated."""
    left, v, right = rng.normal(scale=SIGMA_PX, size=(3, *w.shape[:-1]))
    return np.asarray(w + np.stack([left, v, left - right], axis=-1))


@dataclass(frozen=True, slots=True)
class Scene:
    """Matches of which it is known which are wrong."""

    matches: Matches
    right: NDArray[np.bool_]
    """(n,)"""
    prior: MotionPrior


def scene(
    rng: np.random.Generator,
    camera: StereoCamera,
    motion: Array,
    *,
    outlier_ratio: float,
    n: int = 64,
) -> Scene:
    """A cloud seen before and after a motion; of the outliers, u, v and d are off by up to 20 px.

    The prior is that of a robot whose tracks tell turn and chord, and no side slip.
    """
    points = scattered(rng, n, camera)
    reference = noisy(seen(points, camera), rng)
    current = noisy(seen(moved(points, motion, camera), camera), rng)
    right = np.arange(n) >= round(outlier_ratio * n)
    current[~right] += rng.uniform(-_OUTLIER_PX, _OUTLIER_PX, (int((~right).sum()), 3))
    noise = np.tile(SIGMA_PX**2 * np.array([1.0, 1.0, 2.0, 1.0, 1.0, 2.0]), (n, 1))
    told = np.array([motion[0], motion[1], 0.0])
    prior = ChassisPrior().about(told, 0.02 * abs(motion[1]), np.zeros(6))
    return Scene(Matches(reference, current, noise, n), right, prior)
