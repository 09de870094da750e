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
from grouser.estimators.monocular.look import FEWEST, Look, Verdict, told_of
from grouser.estimators.monocular.management import MapOptions, in_view, new_corners, worth_keeping
from grouser.estimators.monocular.motion_model import Motion, moved
from grouser.estimators.monocular.picture import Picture
from grouser.estimators.monocular.robust_update import RobustUpdate
from grouser.estimators.monocular.search import SearchOptions, Sighting, search
from grouser.estimators.monocular.standing import (
    at_rest,
    between_both,
    then,
    without_points,
    worth_telling,
)
from grouser.estimators.monocular.state import SlamState, initial_state
from grouser.geometry import Array
from grouser.rig import StereoCamera

# Of the points that should be in view, those that must agree: usually some 60 % do.
_AGREEING_SHARE = 0.4
_DOUBTED_SHARE = 0.6  # after a picture of which less agreed
_AS_STILL = 0.9  # of those that any motion explains, the share that rest must explain
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
        self._size = (camera.width, camera.height)
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
        """The estimate after the last picture that did not stand against the tracks."""
        return self._state

    @property
    def now(self) -> SlamState:
        """Where the robot may be: the state, or midway to where the tracks say since pictures stand
        against them."""
        if self._stood is None:
            return self._state
        return between_both(self._state, self._stood, self._walk)

    def start(self, picture: Picture) -> None:
        """At pose zero, which is known, with the first picture."""
        self._state = initial_state(self._constant_sigmas)
        self._appearance = NOTHING_SEEN
        self._stood: Motion | None = None
        self._doubted = False
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
        verdict, look = Verdict.NOTHING, None
        if picture is not None and len(self._state.points) >= FEWEST:
            verdict, look = self._judge(picture, motion, otherwise, rng)
        told = {} if look is None else told_of(look, verdict)
        if verdict is Verdict.STANDS:
            self._stood = motion if self._stood is None else then(self._stood, motion)
            told["ms_filter"] = 1e3 * (time.perf_counter() - started)
            return Step(False, np.zeros(6), told)
        state = self._conclude(verdict, look, motion)
        self._state, self._stood = self._move_on(state), None
        # A map in doubt is not mended: if the doubt lasts, it is given up as a whole.
        if picture is not None and not self._doubted:
            self._initialise(picture)
        told["ms_filter"] = 1e3 * (time.perf_counter() - started)
        tracked = verdict is not Verdict.NOTHING
        return Step(tracked, state.motion if tracked else motion.mean, told)

    def _predict(self, motion: Motion) -> SlamState:
        return moved(self._state, motion, self._walk)

    def _judge(
        self, picture: Picture, motion: Motion, otherwise: Motion, rng: np.random.Generator
    ) -> tuple[Verdict, Look]:
        """What the picture says: as the tracks, or else as if they did not count."""
        share = _DOUBTED_SHARE if self._doubted else _AGREEING_SHARE
        look = self._compare(picture, self._predict(motion), rng)
        if look.expected(share):
            return Verdict.AS_PREDICTED, look
        if self._stood is not None:
            led = self._compare(picture, self._predict(then(self._stood, motion)), rng)
            if led.expected(share):
                return Verdict.AS_PREDICTED, led
        again = self._compare(picture, self._predict(otherwise), rng)
        if not again.supported(share):
            return Verdict.NOTHING, look
        if worth_telling(motion) and motion is not otherwise:
            still = self._compare(picture, self._predict(at_rest(motion)), rng)
            if still.expected(share) and still.agreeing >= _AS_STILL * again.agreeing:
                return Verdict.STANDS, still
        return Verdict.SLIPPED, again

    def _conclude(self, verdict: Verdict, look: Look | None, motion: Motion) -> SlamState:
        """The state once the robot has moved, or what it may be."""
        against = look is not None and verdict is Verdict.NOTHING
        lost, self._doubted = against and self._doubted, against and not self._doubted
        if look is not None:
            self._appearance = self._recognised(look, verdict)
            if verdict is not Verdict.NOTHING:
                return look.updated.state
        if self._stood is not None:
            self._appearance, self._doubted = NOTHING_SEEN, False
            return between_both(self._state, then(self._stood, motion), self._walk)
        state = self._predict(motion)
        if lost:
            self._appearance = NOTHING_SEEN
            return without_points(state)
        return state

    def _compare(self, picture: Picture, predicted: SlamState, rng: np.random.Generator) -> Look:
        projection = project(predicted, self._camera.T_base_camera, self._intrinsics)
        sighting, noise = self._search(picture, predicted, projection)
        matches = Matches(sighting.seen, sighting.places, noise[sighting.seen])
        sought = int(in_view(projection.points, self._size).sum())
        return Look(sought, sighting, self._robust_update(predicted, projection, matches, rng))

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

    def _recognised(self, look: Look, verdict: Verdict) -> Appearance:
        """Which points were seen where they are, and what they look like now."""
        inliers = look.updated.inliers & (verdict is not Verdict.NOTHING)
        n = len(self._appearance.descriptors)
        seen: NDArray[np.bool_] = np.zeros(n, dtype=bool)
        seen[look.sighting.seen[inliers]] = True
        descriptors = self._appearance.descriptors.copy()
        descriptors[look.sighting.seen] = look.sighting.descriptors
        return self._appearance.seen_again(seen, descriptors)

    def _move_on(self, state: SlamState) -> SlamState:
        """The state in the frame of the current camera, without the points that left it."""
        projection = project(state, self._camera.T_base_camera, self._intrinsics)
        kept = worth_keeping(
            projection.points, state, self._appearance, self._size, self._map_options
        )
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
