"""Monocular SLAM from image to image, each with what the tracks say since the one before."""

import time

import numpy as np

from grouser.estimators.base import Observation, PoseEstimate, Status
from grouser.estimators.monocular.landmarks import LandmarkMap, landmarks
from grouser.estimators.monocular.look import FEWEST
from grouser.estimators.monocular.motion_model import TrackModel
from grouser.estimators.monocular.picture import Picture, PictureTaker
from grouser.estimators.monocular.slam import InverseDepthSlam
from grouser.estimators.monocular.state import CONSTANTS, planar_covariance
from grouser.estimators.visual.descriptor import Image
from grouser.estimators.visual.frontend import grey_of
from grouser.geometry import Array, project
from grouser.rig import StereoCamera


class MonocularOdometry:
    """Predicts by the tracks and updates by images that belong to now."""

    def __init__(
        self,
        camera: StereoCamera,
        pictures: PictureTaker,
        tracks: TrackModel,
        slam: InverseDepthSlam,
    ) -> None:
        """camera: of which only the left is used."""
        self._camera, self._pictures = camera, pictures
        self._tracks, self._slam = tracks, slam
        self._rng: np.random.Generator | None = None

    @property
    def map(self) -> LandmarkMap:
        """As the estimator has it.

        Raises:
            RuntimeError: `reset` was not called yet.
        """
        if self._rng is None:
            raise RuntimeError("call reset() with the first observation before asking for the map")
        return landmarks(self._slam.state, self._camera)

    def of_predictor(self) -> tuple[Array, Array]:
        """The tracks' constant errors as estimated (5,), and their covariance (5, 5)."""
        state = self._slam.state
        return state.constants, state.covariance[CONSTANTS, CONSTANTS]

    def reset(self, observation: Observation, *, rng: np.random.Generator) -> PoseEstimate:
        """Start at pose zero, known exactly, with the corners of the first image as points."""
        self._rng = rng
        self._pictures.reset()
        self._before = grey_of(observation, "left", self._camera)
        self._last_motion = np.zeros(6)
        self._slam.start(self._pictures.take(self._before))
        return self._estimate(observation, Status.TRACKING, {})

    def update(self, observation: Observation) -> PoseEstimate:
        """One image: algorithm 1 of Civera et al.

        Raises:
            RuntimeError: `reset` was not called yet.
            ValueError: an image that is not the rig's, or tracks that are not two numbers.
        """
        if self._rng is None:
            raise RuntimeError("call reset() with the first observation before update()")
        started = time.perf_counter()
        du = _increments(observation)
        picture = self._picture(grey_of(observation, "left", self._camera), du)
        taken = time.perf_counter()
        again = self._tracks.expect_again(self._last_motion)
        led = np.isfinite(du).all()
        motion = self._tracks.predict(du, self._slam.state.constants) if led else again
        step = self._slam.step(picture, motion, again, self._rng)
        self._last_motion = step.motion
        told = step.diagnostics | {
            "points": float(len(self._slam.state.points)),
            "ms_picture": 1e3 * (taken - started),
        }
        return self._estimate(
            observation, Status.TRACKING if step.tracked else Status.COASTING, told
        )

    def _picture(self, image: Image, du: Array) -> Picture | None:
        """None where the image shows nothing, or is the one before and nobody says that the robot
        stands: sensors are noisy, and the same bits again are a picture that got stuck."""
        stands = bool(np.abs(du).max() <= _AT_REST)  # not if the tracks are silent
        frozen = not stands and np.array_equal(image, self._before)
        self._before = image
        if frozen:
            return None
        picture = self._pictures.take(image)
        return picture if len(picture.corners) >= FEWEST else None

    def _estimate(
        self, observation: Observation, status: Status, diagnostics: dict[str, float]
    ) -> PoseEstimate:
        state = self._slam.now
        return PoseEstimate(
            pose=project(state.T_start_base),
            covariance=planar_covariance(state),
            status=status,
            stamp=float(observation["stamp"][0]),
            pose_3d=state.T_start_base.copy(),
            diagnostics=diagnostics,
        )


_AT_REST = 1e-3  # m; a camera without noise may show twice the same while the robot stands


def _increments(observation: Observation) -> Array:
    """(2,) left and right increment, m; NaN where the tracks do not report.

    Raises:
        ValueError: they are not two numbers.
    """
    du = np.array(observation["tracks"], dtype=np.float64)
    if du.shape != (2,):
        raise ValueError(f"observation 'tracks' must be two numbers [m], got {du}")
    return du if np.isfinite(du).all() else np.full(2, np.nan)
