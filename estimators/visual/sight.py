"""One look back at the keyframe: match, solve by RANSAC, refine (paper 1 Fig. 3, middle)."""

import time
from dataclasses import dataclass
from typing import Generic

import numpy as np
from numpy.typing import NDArray

from grouser.estimators.visual.base import FrameT, Frontend, KeyframeT
from grouser.estimators.visual.fusion import RelativePose
from grouser.estimators.visual.matching import Matches, Prediction
from grouser.estimators.visual.motion import intrinsics, predict_points
from grouser.estimators.visual.planar_motion import planar_pose, pose_motion, pose_to_motion
from grouser.estimators.visual.prior import Constraint, MotionPrior
from grouser.estimators.visual.refine import Refinement, refine
from grouser.estimators.visual.solver import Hypothesis, MotionSolver
from grouser.estimators.visual.structure import OffsetEvidence, offset_of_structure
from grouser.geometry import Array
from grouser.kernels import kernel_using
from grouser.rig import StereoCamera

FEWEST_MATCHES = 12
FEWEST_AGREEING = 6
FEWEST_REFINED = 10
_WIDE_SEARCH = 20.0  # px in an image 320 px wide: beyond it the first match is only a first guess
# One sigma of (turn, chord, side, height, roll, pitch) where the prediction has failed.
_ASTRAY = np.array([0.05, 0.05, 0.02, 0.03, 0.03, 0.05])
_CHANCE_NOISE = 2.0  # of the assumed pixel variances
_CHANCE_SHARE = 0.5  # of the matches
_UNUSABLE_TURN = 0.05  # rad of sigma: the points do not hold the motion


@dataclass(frozen=True, slots=True)
class Expectation:
    """Where the robot is thought to be, seen from the keyframe."""

    pose: Array
    """(3,)"""
    covariance: Array
    """(3, 3)"""


@dataclass(frozen=True, slots=True)
class Support:
    """What a motion was refined on."""

    matches: Matches
    inliers: NDArray[np.bool_]
    """(n,) of the matches"""
    prior: MotionPrior


@dataclass(frozen=True, slots=True)
class Sight:
    """What vision says of the motion since the keyframe; `motion` is None where it fails."""

    motion: Array | None
    """(6,) as in `visual.motion`"""
    covariance: Array
    """(6, 6)"""
    by_disparity: Array
    """(6,) how far the motion is off per px of a common disparity offset"""
    diagnostics: dict[str, float]
    support: Support | None = None
    """None where vision fails"""

    @property
    def fits_by_chance(self) -> bool:
        """Whether the points agree worse than right matches do, or most matches disagree: wrong
        ones that happen to agree are some 4 to 18 times as noisy as pixels are, right ones 0.1 to 1
        times, and four in five of a small sample then are right."""
        told = self.diagnostics
        noisy = told.get("noise_ratio", 0.0) > _CHANCE_NOISE
        return noisy or told["inliers"] < _CHANCE_SHARE * told["matches"]

    def planar(self) -> RelativePose:
        """The planar part.

        Raises:
            ValueError: vision failed; there is nothing to tell.
        """
        if self.motion is None:
            raise ValueError("a sight without a motion has no planar part")
        pose, covariance, by_disparity = _planar(self.motion, self.covariance, self.by_disparity)
        return RelativePose(pose, covariance, by_disparity)

    def out_of_plane(self) -> tuple[float, float, float]:
        """Height [m], roll and pitch [rad]; zero where vision failed."""
        if self.motion is None:
            return 0.0, 0.0, 0.0
        return float(self.motion[3]), float(self.motion[4]), float(self.motion[5])


class KeyframeSight(Generic[FrameT, KeyframeT]):
    """Sees the motion from one stereo frame to another; has no memory."""

    def __init__(
        self,
        camera: StereoCamera,
        frontend: Frontend[FrameT, KeyframeT],
        solver: MotionSolver,
        *,
        constraint: Constraint = MotionPrior.in_space,
    ) -> None:
        """constraint: what the refinement makes of its prior, one of `REFINEMENTS`."""
        self._camera = camera
        self._intrinsics = intrinsics(camera)
        self._frontend = frontend
        self._solver = solver
        self._constraint = constraint

    def look(
        self,
        keyframe: KeyframeT,
        frame: FrameT,
        expected: Expectation,
        prior: MotionPrior,
        rng: np.random.Generator,
    ) -> Sight:
        """The motion from keyframe to frame. Where nothing is found, a wide search follows, and on
        a wide search a second, narrow one.

        Args:
            expected: where to search.
            prior: what to believe besides; independent of what was seen of this keyframe before.
        """
        started = time.perf_counter()
        mean, covariance = self._search_prior(expected, prior)
        prediction = self._predict(keyframe, mean, covariance)
        predicted = time.perf_counter()
        sight = self._try(keyframe, frame, prediction, prior, rng)
        sight.diagnostics["ms_matching"] += 1e3 * (predicted - started)
        if sight.motion is None:
            return self.look_around(keyframe, frame, expected, prior, rng)
        if self._width(prediction) > _WIDE_SEARCH:
            return self._look_closer(keyframe, frame, sight, prior, rng)
        return sight

    def look_around(
        self,
        keyframe: KeyframeT,
        frame: FrameT,
        expected: Expectation,
        prior: MotionPrior,
        rng: np.random.Generator,
    ) -> Sight:
        """The same by a wide search, where the robot is not as expected: tracks that slip lead the
        search astray, and a kerb tilts the robot as no ground does."""
        mean, covariance = self._search_prior(expected, prior)
        astray = self._predict(keyframe, mean, covariance + np.diag(_ASTRAY**2))
        prior = prior.widened(_ASTRAY)
        sight = self._try(keyframe, frame, astray, prior, rng)
        if sight.motion is None:
            return sight
        return self._look_closer(keyframe, frame, sight, prior, rng)

    def _look_closer(
        self,
        keyframe: KeyframeT,
        frame: FrameT,
        sight: Sight,
        prior: MotionPrior,
        rng: np.random.Generator,
    ) -> Sight:
        """The motion again, sought where a wide search found it."""
        assert sight.motion is not None
        narrow = self._predict(keyframe, sight.motion, sight.covariance)
        again = self._try(keyframe, frame, narrow, prior, rng)
        return again if again.motion is not None else sight

    def disparity_offset(self, sight: Sight) -> OffsetEvidence | None:
        """What its points say of an offset of all disparities; None where they say nothing."""
        if sight.motion is None or sight.support is None:
            return None
        matches = sight.support.matches
        return offset_of_structure(
            matches.reference,
            matches.current,
            motion=sight.motion,
            inliers=sight.support.inliers,
            prior=sight.support.prior,
            noise=matches.noise,
            T_base_camera=self._camera.T_base_camera,
            camera=self._intrinsics,
            bowed=matches.bowed,
        )

    def _search_prior(self, expected: Expectation, prior: MotionPrior) -> tuple[Array, Array]:
        """Mean (6,) and covariance (6, 6) of the motion: on the plane as expected."""
        mean = np.concatenate([pose_motion(expected.pose), prior.mean[3:]])
        covariance = np.diag(np.concatenate([np.zeros(3), prior.sigma[3:] ** 2]))
        to_motion = pose_to_motion(expected.pose)
        covariance[:3, :3] += to_motion @ expected.covariance @ to_motion.T
        return mean, covariance

    def _width(self, prediction: Prediction) -> float:
        """Half the width of the search, px in an image 320 px wide."""
        if len(prediction.points) == 0:
            return 0.0
        width = 3 * float(np.sqrt(np.nanmedian(prediction.covariance[:, 0, 0])))
        return width * 320 / self._camera.width

    def _predict(self, keyframe: KeyframeT, mean: Array, covariance: Array) -> Prediction:
        camera = self._camera
        return Prediction(
            *predict_points(
                keyframe.points,
                mean,
                covariance,
                camera.T_base_camera,
                self._intrinsics,
                self._frontend.expected_noise,
            )
        )

    def _try(
        self,
        keyframe: KeyframeT,
        frame: FrameT,
        prediction: Prediction,
        prior: MotionPrior,
        rng: np.random.Generator,
    ) -> Sight:
        """Match, solve, refine; blind where too few points are left after a stage."""
        started = time.perf_counter()
        matches = self._frontend.match(keyframe, frame, prediction)
        matched = time.perf_counter()
        told = _told_of_matches(matches) | {"ms_matching": 1e3 * (matched - started)}
        if len(matches.reference) < FEWEST_MATCHES:
            return _blind(told)
        hypothesis = self._solver.solve(matches, prior, rng)
        solved = time.perf_counter()
        if hypothesis is None or hypothesis.inliers.sum() < FEWEST_AGREEING:
            return _blind(told)
        refined = self._refine(matches, hypothesis, prior)
        told |= _told_of_motion(hypothesis, refined)
        told["ms_ransac"] = 1e3 * (solved - matched)
        told["ms_refinement"] = 1e3 * (time.perf_counter() - solved)
        if not _usable(refined):
            return _blind(told)
        support = Support(matches, refined.inliers, prior)
        return Sight(refined.motion, refined.covariance, refined.by_disparity, told, support)

    def _refine(self, matches: Matches, hypothesis: Hypothesis, prior: MotionPrior) -> Refinement:
        return refine(
            matches.reference,
            matches.current,
            start=hypothesis.motion,
            supporters=hypothesis.inliers,
            prior=self._constraint(prior),
            noise=matches.noise,
            T_base_camera=self._camera.T_base_camera,
            camera=self._intrinsics,
            shares=matches.shares,
        )


def _blind(diagnostics: dict[str, float]) -> Sight:
    return Sight(None, np.zeros((6, 6)), np.zeros(6), diagnostics)


def _usable(refined: Refinement) -> bool:
    enough = refined.inliers.sum() >= FEWEST_REFINED
    return bool(enough and refined.covariance[0, 0] <= _UNUSABLE_TURN**2)


def _told_of_matches(matches: Matches) -> dict[str, float]:
    return {
        "candidates": float(matches.candidates),
        "matches": float(len(matches.reference)),
        "inliers": 0.0,
    }


def _told_of_motion(hypothesis: Hypothesis, refined: Refinement) -> dict[str, float]:
    return {
        "agreeing": float(hypothesis.inliers.sum()),
        "trials": float(hypothesis.trials),
        "inliers": float(refined.inliers.sum()),
        "iterations": float(refined.iterations),
        "noise_ratio": refined.noise_ratio,
    }


@kernel_using(planar_pose)
def _planar(motion: Array, covariance: Array, by_disparity: Array) -> tuple[Array, Array, Array]:
    """Pose (3,) of a motion (6,), its covariance, and its derivative by the disparity offset."""
    pose, to_pose = planar_pose(motion)
    planar = np.ascontiguousarray(covariance[:3, :3])
    return pose, to_pose @ planar @ to_pose.T, to_pose @ by_disparity[:3]
