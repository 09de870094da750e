"""Three-point RANSAC (Nister et al. 2004): the camera's pose from three points of known depth.

Stereo gives the points in the reference frame; where the left eye sees them now gives the pose
(P3P, OpenCV's AP3P after Ke and Roumeliotis 2017), and the present disparities tell which of its up
to four solutions. Six degrees of freedom, no chassis.
"""

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from grouser.estimators.visual.agreement import squared_errors
from grouser.estimators.visual.chassis import chassis_motions
from grouser.estimators.visual.matching import Matches
from grouser.estimators.visual.motion import intrinsics
from grouser.estimators.visual.prior import MotionPrior
from grouser.estimators.visual.ransac import LIMIT, ransac
from grouser.estimators.visual.rays import disparity_rays
from grouser.estimators.visual.solver import Hypothesis, MotionSolver
from grouser.geometry import Array
from grouser.rig import StereoCamera

_SAMPLE = 3
_FLAT = 1e-9  # least volume that a sample's rays span: points in a plane with the eye fix no pose


class ThreePointRansac(MotionSolver):
    """Any motion in six degrees of freedom."""

    def __init__(self, camera: StereoCamera) -> None:
        self._camera = camera

    def solve(
        self, matches: Matches, prior: MotionPrior, rng: np.random.Generator
    ) -> Hypothesis | None:
        before = disparity_rays(matches.reference, self._camera)
        now = disparity_rays(matches.current, self._camera)
        told = matches.reference, matches.current, matches.noise
        mount, camera = self._camera.T_base_camera, intrinsics(self._camera)

        def propose(samples: NDArray[np.intp]) -> Array:
            R, t = poses_of_three(
                before[0][samples], before[1][samples], now[0][samples], now[1][samples]
            )
            return chassis_motions(R, t, mount)

        def judge(motions: Array) -> Array:
            return np.asarray(squared_errors(motions, *told, np.zeros(6), mount, camera) / LIMIT)

        usable = np.flatnonzero((before[1] > 0) & (now[1] > 0))
        found = ransac(usable, _SAMPLE, propose, judge, rng)
        return None if found is None else Hypothesis(found.model, found.inliers, found.trials)


def poses_of_three(
    rays: Array, inverse: Array, rays_: Array, inverse_: Array
) -> tuple[Array, Array]:
    """R (j, 3, 3) and t (j, 3) [m] of the samples, j of k, that fix a pose.

    Args: rays (k, 3, 3) and inverse depths (k, 3) [1/m] of each sample's points before, and now.
    """
    points = rays / inverse[..., None]
    owner, R, t = _solutions(rays, points, rays_)
    if len(owner) == 0:
        return R, t
    depth = (np.einsum("kmi,ki->km", points[owner], R[:, 2]) + t[:, 2:]) * inverse_[owner]
    misfit = ((depth - 1) ** 2).sum(axis=1)  # depth over what the disparity says it is
    misfit = np.where(np.isfinite(misfit), misfit, np.inf)
    order = np.lexsort((misfit, owner))
    first = order[np.unique(owner[order], return_index=True)[1]]
    first = first[np.isfinite(misfit[first])]
    return R[first], t[first]


def _solutions(rays: Array, points: Array, rays_: Array) -> tuple[NDArray[np.intp], Array, Array]:
    """All of P3P's solutions: the sample (j,) that each belongs to, R (j, 3, 3) and t (j, 3)."""
    owners: list[int] = []
    turns: list[Array] = []
    shifts: list[Array] = []
    for k in np.flatnonzero(np.abs(np.linalg.det(rays)) > _FLAT):
        seen = np.ascontiguousarray(rays_[k, :, :2])
        number, r, t = cv2.solveP3P(points[k], seen, np.eye(3), None, flags=cv2.SOLVEPNP_AP3P)
        owners.extend([int(k)] * number)
        turns.extend(np.ravel(turn) for turn in r)
        shifts.extend(np.ravel(shift) for shift in t)
    R = Rotation.from_rotvec(np.reshape(turns, (-1, 3))).as_matrix() if turns else []
    return np.array(owners, dtype=np.intp), np.reshape(R, (-1, 3, 3)), np.reshape(shifts, (-1, 3))
