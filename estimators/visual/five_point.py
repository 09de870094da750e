"""Five-point RANSAC (Nister 2004): the essential matrix, with its scale taken from stereo."""

import cv2
import numpy as np

from grouser.estimators.visual.chassis import chassis_motions
from grouser.estimators.visual.matching import Matches
from grouser.estimators.visual.prior import MotionPrior
from grouser.estimators.visual.solver import Hypothesis, MotionSolver
from grouser.geometry import Array
from grouser.rig import StereoCamera

_THRESHOLD = 1.0  # px
_CONFIDENCE = 0.999
_MOST_TRIALS = 1000
_SAMPLE = 5
_ANY_DISTANCE = 1e9  # lengths of the translation


class FivePointRansac(MotionSolver):
    """OpenCV's five-point solver and RANSAC, seeded by us; any motion in six degrees of freedom."""

    def __init__(self, camera: StereoCamera) -> None:
        self._camera = camera
        self._K = np.array(
            [[camera.fx, 0.0, camera.cx], [0.0, camera.fy, camera.cy], [0.0, 0.0, 1.0]]
        )

    def solve(
        self, matches: Matches, prior: MotionPrior, rng: np.random.Generator
    ) -> Hypothesis | None:
        if len(matches.reference) < _SAMPLE:
            return None
        before, now = self._normalised(matches.reference), self._normalised(matches.current)
        E, mask = cv2.findEssentialMat(
            before, now, np.eye(3), np.eye(3), np.zeros(4), np.zeros(4), self._options(rng)
        )
        if E is None or E.shape != (3, 3):
            return None
        # OpenCV calls a point that is 50 steps away infinite and drops it; steps are short here.
        _, R, direction, mask, _ = cv2.recoverPose(
            E, before, now, np.eye(3), distanceThresh=_ANY_DISTANCE, mask=mask
        )
        inliers = mask.ravel() > 0
        if inliers.sum() < _SAMPLE:
            return None
        length = self._scale(before, now, matches, R, direction[:, 0], inliers)
        if length is None:
            return None
        motion = chassis_motions(R, length * direction[:, 0], self._camera.T_base_camera)
        return Hypothesis(motion, inliers, _MOST_TRIALS)

    def _normalised(self, points: Array) -> Array:
        camera = self._camera
        return np.column_stack(
            [(points[:, 0] - camera.cx) / camera.fx, (points[:, 1] - camera.cy) / camera.fy]
        )

    def _options(self, rng: np.random.Generator) -> cv2.UsacParams:
        options = cv2.UsacParams()
        options.randomGeneratorState = int(rng.integers(1, 2**31 - 1))
        options.threshold = _THRESHOLD / self._camera.fx
        options.confidence = _CONFIDENCE
        options.maxIterations = _MOST_TRIALS
        options.sampler = cv2.SAMPLING_UNIFORM
        options.score = cv2.SCORE_METHOD_MSAC
        options.isParallel = False
        return options

    def _scale(
        self,
        before: Array,
        now: Array,
        matches: Matches,
        R: Array,
        direction: Array,
        inliers: Array,
    ) -> float | None:
        """Length of the translation [m]: the median over points whose depth stereo knows.

        None where it knows none. With P = ray / i (i the inverse depth),
        P' = R P + length * direction is seen at `now`:
        cross(now, R ray + i length direction) = 0 gives the length of each point by projection.
        """
        camera = self._camera
        ray = np.column_stack([before, np.ones(len(before))]) @ R.T
        inverse_depth = matches.reference[:, 2] / (camera.fx * camera.baseline)
        seen = np.column_stack([now, np.ones(len(now))])
        moved = np.cross(seen, direction) * inverse_depth[:, None]
        still = np.cross(seen, ray)
        length = -(still * moved).sum(axis=1) / np.maximum((moved**2).sum(axis=1), 1e-18)
        # A point tells of the length as well as the translation moves it in the image.
        weights = np.linalg.norm(moved[inliers], axis=1)
        return weighted_median(length[inliers], weights) if weights.any() else None


def weighted_median(values: Array, weights: Array) -> float:
    """The value below which half the weight lies."""
    order = np.argsort(values, kind="stable")
    share = np.cumsum(weights[order])
    return float(values[order][np.searchsorted(share, share[-1] / 2)])
