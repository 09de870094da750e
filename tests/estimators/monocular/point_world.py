"""A world of points without images: the filter alone, on measurements whose noise is known."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from grouser.estimators.monocular.camera import Matches, inverse_depth_intrinsics, project
from grouser.estimators.monocular.kalman import compose, motion_pose
from grouser.estimators.monocular.motion_model import TrackModel, moved
from grouser.estimators.monocular.robust_update import RobustUpdate, Updated
from grouser.estimators.monocular.state import SlamState, initial_state
from grouser.estimators.synthetic_drive import RIG
from grouser.estimators.track_motion import TrackNoise
from grouser.estimators.visual.prior import ChassisPrior
from grouser.geometry import Array, inverse_transform
from grouser.rig import StereoCamera

assert RIG.stereo is not None and RIG.tracks is not None
CAMERA: StereoCamera = RIG.stereo
INTRINSICS = inverse_depth_intrinsics(CAMERA)
PRIOR = ChassisPrior()
TRACKS = TrackModel(RIG.tracks, TrackNoise(), 0.05, PRIOR, np.zeros(6))
CONSTANT_SIGMAS = np.array([0.01, 0.01, 0.05, 0.03, 0.012])
NOISE_PX = 0.2
FIRST_GUESS, FIRST_SIGMA, MOST = 0.5, 6.0, 40


def cloud(rng: np.random.Generator, n: int = 4000) -> Array:
    """(n, 3) points on the ground and on walls 6 m around a course of some metres."""
    on_ground = rng.uniform([-7, -7, 0], [7, 7, 0], (n // 2, 3))
    bearing = rng.uniform(-np.pi, np.pi, n - n // 2)
    walls = np.column_stack(
        [6 * np.cos(bearing), 6 * np.sin(bearing), rng.uniform(0, 2.5, n - n // 2)]
    )
    return np.concatenate([on_ground, walls])


def seen_from(T_start_base: Array, points: Array) -> Array:
    """(n, 3) u, v [px], inverse depth [1/m] of points (n, 3); NaN out of view."""
    T_camera = inverse_transform(T_start_base @ CAMERA.T_base_camera)
    p = points @ T_camera[:3, :3].T + T_camera[:3, 3]
    with np.errstate(divide="ignore", invalid="ignore"):
        u = CAMERA.cx + CAMERA.fx * p[:, 0] / p[:, 2]
        v = CAMERA.cy + CAMERA.fy * p[:, 1] / p[:, 2]
        inside = (p[:, 2] > 0.3) & (u > 0) & (u < CAMERA.width) & (v > 0) & (v < CAMERA.height)
        return np.where(inside[:, None], np.column_stack([u, v, 1 / p[:, 2]]), np.nan)


@dataclass
class Run:
    """The filter on its way through a cloud, beside the truth, which obeys the filter's model."""

    rng: np.random.Generator
    sample: int = 1
    outliers: float = 0.0
    """Share of the matches that lie anywhere within 15 px of where they are expected."""
    scale: float | None = None
    """Of both tracks' increments over what they ran; None draws every constant error."""
    T: Array = field(default_factory=lambda: np.eye(4))
    state: SlamState = field(default_factory=lambda: initial_state(CONSTANT_SIGMAS))
    known: NDArray[np.int64] = field(default_factory=lambda: np.zeros(0, dtype=np.int64))

    def __post_init__(self) -> None:
        self.points = cloud(self.rng)
        self.constants = CONSTANT_SIGMAS * self.rng.standard_normal(5)
        if self.scale is not None:
            self.constants = np.array([self.scale, self.scale, 0.0, 0.0, 0.0])
        self.update = RobustUpdate(CAMERA.T_base_camera, INTRINSICS, self.sample, 1.0)
        self._initialise()

    def step(self, du: Array) -> tuple[Updated, NDArray[np.bool_]]:
        """Drive with increments (2,), look; the update, and which matches were wrong."""
        truth = TRACKS.predict(du, self.constants)
        self.T = self.T @ motion_pose(self.rng.multivariate_normal(truth.mean, truth.covariance))
        predicted = moved(self.state, TRACKS.predict(du, self.state.constants), 0.0)
        projection = project(predicted, CAMERA.T_base_camera, INTRINSICS)
        seen = seen_from(self.T, self.points[self.known])[:, :2]
        index = np.flatnonzero(np.isfinite(seen[:, 0]) & np.isfinite(projection.points[:, 0]))
        places = seen[index] + self.rng.normal(0, NOISE_PX, (len(index), 2))
        wrong = self.rng.random(len(index)) < self.outliers
        astray = projection.points[index, :2] + self.rng.uniform(-15, 15, places.shape)
        places[wrong] = astray[wrong]
        noise = np.full(len(index), NOISE_PX**2)
        updated = self.update(predicted, projection, Matches(index, places, noise), self.rng)
        self._move_on(updated.state, index)
        return updated, wrong

    def _move_on(self, state: SlamState, seen: NDArray[np.int64]) -> None:
        projection = project(state, CAMERA.T_base_camera, INTRINSICS)
        kept = np.zeros(len(self.known), dtype=bool)
        kept[seen] = np.isfinite(projection.points[seen, 0])
        self.state = compose(state.keeping(kept), projection.keeping(kept))
        self.known = self.known[kept]
        self._initialise()

    def _initialise(self) -> None:
        places = seen_from(self.T, self.points)
        visible = np.setdiff1d(np.flatnonzero(np.isfinite(places[:, 0])), self.known)
        new = self.rng.permutation(visible)[: MOST - len(self.known)]
        points = places[new] + self.rng.normal(0, NOISE_PX, (len(new), 3)) * [1, 1, 0]
        points[:, 2] = FIRST_GUESS
        self.state = self.state.with_points(points, np.array([NOISE_PX, NOISE_PX, FIRST_SIGMA]))
        self.known = np.concatenate([self.known, new])


def course(steps: int) -> Array:
    """(steps, 2) increments of a winding drive with tight turns, m."""
    turn = 0.012 * np.sin(np.arange(steps) / 12)
    return np.column_stack([0.04 - turn, 0.04 + turn])
