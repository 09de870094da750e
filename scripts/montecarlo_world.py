"""The synthetic world of SPEC 1.7: points that come into view and leave it, and tracks that err.

No images: what the estimator is shown are noisy point positions with their identities, of which
a share is matched wrongly, and the tracks' increments.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from grouser.estimators.base import Observation
from grouser.estimators.visual.point_frontend import middle_eye
from grouser.geometry import Array, compose, inverse_transform, lift, rotate
from grouser.rig import Rig, StereoCamera, TrackGeometry

DT = 1 / 30  # s
TRACKS = TrackGeometry(gauge=0.35, width=0.05, effective_width=0.40)
_NOBODY = -1


@dataclass(frozen=True, slots=True)
class WorldOptions:
    """How much is seen, and how badly."""

    in_view: int = 128
    """Points that the left eye sees; the estimator uses up to 64 of them."""
    depth: tuple[float, float] = (0.8, 9.0)
    """m"""
    noise_px: float = 0.3
    """Of u and v in the left eye and of u in the right one."""
    outliers: float = 0.3
    """Share of the matches that are wrong."""
    outlier_px: float = 20.0
    """They are off by up to this in u, v and d."""
    scale_sigma: float = 0.01
    """Of a track's constant scale error."""
    width_sigma: float = 0.02
    """Of the effective width's constant scale error."""
    white_noise: float = 0.02
    """Of a track's increment, as a share of it."""


@dataclass(frozen=True, slots=True)
class Motion:
    """What the robot does in a scenario, frame by frame."""

    turn: Array
    """(n,) rad"""
    chord: Array
    """(n,) m"""
    side: Array
    """(n,) m across the half-angle frame"""
    reported_turn: Array
    """(n,) rad that the tracks would report if they measured without error"""
    reported_chord: Array
    """(n,) m"""
    dark: NDArray[np.bool_]
    """(n,) no points are seen after this increment"""


@dataclass(frozen=True, slots=True)
class Run:
    """One drive."""

    rig: Rig
    """As calibrated; the camera is the middle eye."""
    observations: list[Observation]
    """n + 1"""
    truth: Array
    """(n + 1, 3)"""


def drive(
    motion: Motion, camera: StereoCamera, options: WorldOptions, rng: np.random.Generator
) -> Run:
    """The robot of a scenario, with this camera (left eye), in a world of its own."""
    track_rng, point_rng = rng.spawn(2)
    truth = _poses(motion)
    tracks = _tracks(motion, options, track_rng)
    view = _View(camera, options, point_rng)
    observations: list[Observation] = []
    for k, pose in enumerate(truth):
        seen = view.look(pose, dark=bool(k and motion.dark[k - 1]))
        seen["tracks"] = tracks[k - 1] if k else np.zeros(2)
        seen["stamp"] = np.array([k * DT])
        observations.append(seen)
    rig = Rig(dt=DT, tracks=TRACKS, stereo=middle_eye(camera))
    return Run(rig, observations, truth)


def _poses(motion: Motion) -> Array:
    poses = [np.zeros(3)]
    for turn, chord, side in zip(motion.turn, motion.chord, motion.side, strict=True):
        step = np.append(rotate(turn / 2, [chord, side]), turn)
        poses.append(compose(poses[-1], step))
    return np.array(poses)


def _tracks(motion: Motion, options: WorldOptions, rng: np.random.Generator) -> Array:
    """(n, 2) reported increments: the true ones, with constant scales and white noise."""
    half = motion.reported_turn / 2
    arc = motion.reported_chord / np.sinc(half / np.pi)
    width = TRACKS.effective_width * (1 + options.width_sigma * rng.normal())
    true = arc[:, None] + half[:, None] * width * np.array([-1.0, 1.0])
    scales = 1 + options.scale_sigma * rng.normal(size=2)
    return np.asarray(true * scales * (1 + options.white_noise * rng.normal(size=true.shape)))


class _View:
    """The points in view: who leaves it is replaced by somebody new."""

    def __init__(
        self, camera: StereoCamera, options: WorldOptions, rng: np.random.Generator
    ) -> None:
        self._camera = camera
        self._options = options
        self._rng = rng
        self._points = np.zeros((options.in_view, 3))
        """In the world [m]."""
        self._identities = np.full(options.in_view, _NOBODY)
        self._next = 0

    def look(self, pose: Array, *, dark: bool) -> dict[str, NDArray[Any]]:
        """What is seen from a pose; the world changes in the dark as it does in the light."""
        T_world_camera = lift(pose) @ self._camera.T_base_camera
        seen = self._replace_the_lost(T_world_camera)
        options, rng, n = self._options, self._rng, len(seen)
        eyes = np.column_stack([seen[:, 0], seen[:, 1], seen[:, 0] - seen[:, 2]])
        eyes += options.noise_px * rng.normal(size=(n, 3))
        points = _from_eyes(eyes)
        mismatched = self._mismatched(points)
        kept = np.flatnonzero((points[:, 2] > 0) & (not dark))
        return {
            "points": points[kept],
            "identities": self._identities[kept],
            "mismatched": mismatched[kept],
        }

    def _mismatched(self, points: Array) -> Array:
        """The points, but for a share that is taken for something else in front of the camera."""
        rng, most, n = self._rng, self._options.outlier_px, len(points)
        wrong = rng.uniform(size=n) < self._options.outliers
        off = rng.uniform(-most, most, size=(n, 3))
        nearest = np.maximum(-most, _LEAST_DISPARITY - points[:, 2])
        off[:, 2] = rng.uniform(nearest, most)
        return np.where(wrong[:, None], points + off, points)

    def _replace_the_lost(self, T_world_camera: Array) -> Array:
        """u, v of the left eye and disparity (n, 3) of all points, each of them in view."""
        T = inverse_transform(T_world_camera)
        there = self._points @ T[:3, :3].T + T[:3, 3]
        lost = np.flatnonzero(~self._in_view(there) | (self._identities == _NOBODY))
        there[lost] = self._scattered(len(lost))
        self._points[lost] = there[lost] @ T_world_camera[:3, :3].T + T_world_camera[:3, 3]
        self._identities[lost] = self._next + np.arange(len(lost))
        self._next += len(lost)
        return self._project(there)

    def _project(self, points: Array) -> Array:
        c, z = self._camera, points[:, 2]
        u, v = c.fx * points[:, 0] / z + c.cx, c.fy * points[:, 1] / z + c.cy
        return np.column_stack([u, v, c.fx * c.baseline / z])

    def _in_view(self, points: Array) -> NDArray[np.bool_]:
        near, far = self._options.depth
        ahead = (points[:, 2] > near) & (points[:, 2] < far)
        u, v, d = self._project(np.where(ahead[:, None], points, [0.0, 0.0, 1.0])).T
        inside = (u - d >= 0) & (u < self._camera.width) & (v >= 0) & (v < self._camera.height)
        return np.asarray(ahead & inside)

    def _scattered(self, n: int) -> Array:
        """(n, 3) points of the camera frame [m], uniform in depth and over what both eyes see."""
        c, rng = self._camera, self._rng
        z = rng.uniform(*self._options.depth, n)
        u = rng.uniform(c.fx * c.baseline / z, c.width)
        x, y = (u - c.cx) / c.fx, (rng.uniform(0, c.height, n) - c.cy) / c.fy
        return np.asarray(np.column_stack([x, y, np.ones(n)]) * z[:, None])


def _from_eyes(eyes: Array) -> Array:
    """u, v, d of the middle eye from u_left, v, u_right (n, 3) [px]."""
    disparity = eyes[:, 0] - eyes[:, 2]
    return np.column_stack([eyes[:, 0] - disparity / 2, eyes[:, 1], disparity])


_LEAST_DISPARITY = 0.5  # px
