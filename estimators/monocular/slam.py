"""Monocular EKF SLAM with RANSAC on the filter's prior: algorithm 1 of Civera et al. (2010)."""

import time
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from grouser.estimators.monocular.appearance import (
    NOTHING_SEEN,
    Appearance,
    first_sight,
    patch_warps,
)
from grouser.estimators.monocular.camera import (
    Matches,
    Projection,
    inverse_depth_intrinsics,
    place_covariances,
    project,
)
from grouser.estimators.monocular.kalman import compose, motion_pose
from grouser.estimators.monocular.management import MapOptions, new_corners, worth_keeping
from grouser.estimators.monocular.motion_model import Motion, moved
from grouser.estimators.monocular.picture import Picture
from grouser.estimators.monocular.robust_update import RobustUpdate, Updated
from grouser.estimators.monocular.search import SearchOptions, Sighting, search
from grouser.estimators.monocular.state import SlamState, initial_state
from grouser.geometry import Array
from grouser.rig import StereoCamera

FEWEST = 8
"""Points that must agree, or the picture tells nothing."""
_AGREEING_SHARE = 0.3  # of the matches
_SLIP_GATE = 16.3  # chi-square of 3 degrees of freedom at 99.9 %
_CUT = 0.05  # px; a point is by definition where its patch was cut, but for the patch's own noise


@dataclass(frozen=True, slots=True)
class PatchNoise:
    """Sigma of an aligned point."""

    place: float = 0.5
    """px, of a patch that looks as at first sight"""
    deformation: float = 0.4
    """px more per unit by which it is stretched or sheared: detail comes and goes with it"""

    def variances(self, warps: Array) -> Array:
        """(n,) of either coordinate [px^2], under warps (n, 2, 2)."""
        stretch = np.linalg.norm(warps - np.eye(2), axis=(1, 2))
        return np.asarray(self.place**2 + (self.deformation * stretch) ** 2)


@dataclass(frozen=True, slots=True)
class Step:
    """How the filter took one picture."""

    tracked: bool
    """The picture supports the new pose; else it is predicted."""
    motion: Array
    """(6,) since the picture before"""
    diagnostics: dict[str, float]


@dataclass(frozen=True, slots=True)
class _Look:
    """A predicted state, compared with a picture."""

    predicted: SlamState
    sighting: Sighting
    updated: Updated

    @property
    def supported(self) -> bool:
        """Enough of what was found agrees."""
        agreeing = int(self.updated.inliers.sum())
        return agreeing >= max(FEWEST, _AGREEING_SHARE * len(self.sighting.seen))

    @property
    def expected(self) -> bool:
        """It agrees on a motion such as was predicted."""
        return self.supported and self.updated.nis <= _SLIP_GATE


class InverseDepthSlam:
    """The filter with its map, from picture to picture."""

    def __init__(
        self,
        camera: StereoCamera,
        *,
        sample: int,
        threshold_px: float,
        map_options: MapOptions,
        search_options: SearchOptions,
        noise: PatchNoise,
        constant_sigmas: Array,
        walk: float,
    ) -> None:
        """
        Args:
            camera: of which only the left is used.
            sample: matches that a hypothesis takes, 1 or 2.
            threshold_px: of a low-innovation inlier, in an image 320 px wide.
            constant_sigmas: (5,) of the tracks' constant errors at the start.
            walk: how far each wanders in a frame, one sigma.
        """
        self._camera = camera
        self._intrinsics = inverse_depth_intrinsics(camera)
        self._scale = camera.width / 320
        self._robust_update = RobustUpdate(
            camera.T_base_camera, self._intrinsics, sample, threshold_px * self._scale
        )
        self._map_options = map_options
        self._search_options = search_options
        self._noise = noise
        self._constant_sigmas = constant_sigmas
        self._walk = walk

    @property
    def state(self) -> SlamState:
        """The estimate after the last picture."""
        return self._state

    def start(self, picture: Picture) -> None:
        """At pose zero, which is known, with the first picture."""
        self._state = initial_state(self._constant_sigmas)
        self._appearance = NOTHING_SEEN
        self._initialise(picture)

    def step(
        self,
        picture: Picture | None,
        motion: Motion,
        otherwise: Motion,
        rng: np.random.Generator,
    ) -> Step:
        """Predict, measure, RANSAC, update, rescue, update, and manage the map.

        Args:
            picture: None where nothing can be seen.
            motion: what the tracks say of the motion since the picture before.
            otherwise: what is expected if they slip, which the picture then tells.
        """
        started = time.perf_counter()
        state, told, tracked = self._predict(motion), {}, False
        if picture is not None and len(state.points) >= FEWEST:
            look, slipped = self._look(picture, state, otherwise, rng)
            told, tracked = _told(look, slipped), look.supported
            self._appearance = self._recognised(look)
            state = look.updated.state if tracked else state
        moved_on = state.motion
        self._state = self._move_on(state)
        if picture is not None:
            self._initialise(picture)
        told["ms_filter"] = 1e3 * (time.perf_counter() - started)
        return Step(tracked, moved_on, told)

    def _predict(self, motion: Motion) -> SlamState:
        return moved(self._state, motion, self._walk)

    def _look(
        self, picture: Picture, predicted: SlamState, otherwise: Motion, rng: np.random.Generator
    ) -> tuple[_Look, bool]:
        """What the picture says, and whether the tracks slipped: then they do not count."""
        look = self._compare(picture, predicted, rng)
        if look.expected:
            return look, False
        again = self._compare(picture, self._predict(otherwise), rng)
        if again.supported:
            return again, True
        return look, False

    def _compare(self, picture: Picture, predicted: SlamState, rng: np.random.Generator) -> _Look:
        projection = project(predicted, self._camera.T_base_camera, self._intrinsics)
        sighting, noise = self._search(picture, predicted, projection)
        matches = Matches(sighting.seen, sighting.places, noise[sighting.seen])
        return _Look(predicted, sighting, self._robust_update(predicted, projection, matches, rng))

    def _search(
        self, picture: Picture, predicted: SlamState, projection: Projection
    ) -> tuple[Sighting, Array]:
        """Where the points are found; the variance (n,) of either coordinate if they are [px^2]."""
        T_start_camera = self._camera_pose(predicted)
        warps = patch_warps(self._appearance, projection.points, T_start_camera, self._camera)
        noise = self._noise.variances(warps)
        spread = place_covariances(predicted, projection)
        sighting = search(
            picture, self._appearance, projection.points, spread, warps, self._search_options
        )
        return sighting, noise

    def _camera_pose(self, state: SlamState) -> Array:
        """T_start_camera (4, 4) after the state's motion."""
        T_start_base = state.T_start_base @ motion_pose(state.motion)
        return np.asarray(T_start_base @ self._camera.T_base_camera)

    def _recognised(self, look: _Look) -> Appearance:
        """Which points were seen where they are, and what they look like now."""
        inliers = look.updated.inliers & look.supported
        n = len(self._appearance.descriptors)
        seen: NDArray[np.bool_] = np.zeros(n, dtype=bool)
        seen[look.sighting.seen[inliers]] = True
        descriptors = self._appearance.descriptors.copy()
        descriptors[look.sighting.seen] = look.sighting.descriptors
        return self._appearance.seen_again(seen, descriptors)

    def _move_on(self, state: SlamState) -> SlamState:
        """The state in the frame of the current camera, without the points that left it."""
        projection = project(state, self._camera.T_base_camera, self._intrinsics)
        size = (self._camera.width, self._camera.height)
        kept = worth_keeping(projection.points, state, self._appearance, size, self._map_options)
        self._appearance = self._appearance.keeping(kept)
        return compose(state.keeping(kept), projection.keeping(kept))

    def _initialise(self, picture: Picture) -> None:
        """New points where the image has strong corners and the map has none."""
        options, state = self._map_options, self._state
        chosen = new_corners(
            picture,
            state.points[:, :2],
            options.points - len(state.points),
            options.spacing * self._scale,
        )
        corners = picture.corners[chosen]
        points = np.column_stack([corners, np.full(len(corners), options.inverse_depth)])
        self._state = state.with_points(points, np.array([_CUT, _CUT, options.inverse_depth_sigma]))
        self._appearance = self._appearance.with_points(
            first_sight(
                picture.aligned, corners, picture.descriptors[chosen], self._camera_pose(state)
            )
        )


def _told(look: _Look, slipped: bool) -> dict[str, float]:
    updated = look.updated
    return {
        "matches": float(len(look.sighting.seen)),
        "inliers": float(updated.inliers.sum()),
        "rescued": float(updated.rescued.sum()),
        "trials": float(updated.trials),
        "nis": updated.nis,
        "slipped": float(slipped),
    }
