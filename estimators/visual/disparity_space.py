"""Motion in disparity space (Demirdjian and Darrell 2002; Wu, Zhou and Gu 2007, paper 1's [7]).

In metres a point's noise grows with the square of its range; in disparity space, where it was
measured, it is alike everywhere. A rigid motion is a homography there: with rays q, q', inverse
depths i, i' and the disparity ratio r = i / i',

    R q + t i = r q'.

Given the ratios this is absolute orientation in closed form, and three matches suffice. A measured
ratio is many times as noisy as a place in the image, so with all matches that agree the ratios are
updated by what the motion says of them: Wu's second step, least squares of the errors in (u, v, d).
"""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from grouser.estimators.visual.chassis import chassis_motions
from grouser.estimators.visual.matching import Matches
from grouser.estimators.visual.prior import MotionPrior
from grouser.estimators.visual.ransac import ransac
from grouser.estimators.visual.rays import disparity_rays
from grouser.estimators.visual.solver import Hypothesis, MotionSolver
from grouser.geometry import Array
from grouser.rig import StereoCamera

_SAMPLE = 3
_THRESHOLD = 1.5  # px of (u, v, d) together
_UPDATES = 10
_SETTLED = 1e-9  # rad and m
_LINE = 1e-6  # least second extent of a sample over its first


class DisparitySpace(MotionSolver):
    """Any motion in six degrees of freedom, as a homography of disparity space under RANSAC."""

    def __init__(self, camera: StereoCamera) -> None:
        self._camera = camera

    def solve(
        self, matches: Matches, prior: MotionPrior, rng: np.random.Generator
    ) -> Hypothesis | None:
        q, i = disparity_rays(matches.reference, self._camera)
        q_, i_ = disparity_rays(matches.current, self._camera)
        usable = np.flatnonzero((i > 0) & (i_ > 0))
        ratio = np.full(len(i), np.nan)
        ratio[usable] = i[usable] / i_[usable]

        def propose(samples: NDArray[np.intp]) -> Array:
            return align(q[samples], i[samples], q_[samples], ratio[samples])

        def judge(motions: Array) -> Array:
            _, errors = predict(motions, q, i, matches.current, self._camera)
            return np.asarray(np.nan_to_num((errors**2).sum(axis=-1) / _THRESHOLD**2, nan=np.inf))

        found = ransac(usable, _SAMPLE, propose, judge, rng)
        if found is None:
            return None
        agree = usable[found.inliers[usable]]
        if len(agree) < _SAMPLE:
            return None
        settled = settle(found.model, q[agree], i[agree], matches.current[agree], self._camera)
        inliers = judge(settled[None])[0] < 1.0
        motion = chassis_motions(settled[:, :3], settled[:, 3], self._camera.T_base_camera)
        return Hypothesis(motion, inliers, found.trials)


def align(q: Array, i: Array, q_: Array, ratio: Array) -> Array:
    """The motions [R | t] (j, 3, 4) that least violate R q + t i = ratio q', j of k.

    Args: rays q, q' (k, m, 3), inverse depths i and ratios (k, m) of the points of k samples;
    those whose points are one or on a line through the eye's plane fix no motion and are left out.
    """
    target = ratio[..., None] * q_
    weight = (i**2).sum(axis=-1)[:, None]
    centre, centre_ = (
        (i[..., None] * side).sum(axis=-2) / weight for side in (q, target)
    )  # of the least squares over t
    arms, arms_ = q - i[..., None] * centre[:, None], target - i[..., None] * centre_[:, None]
    U, extent, Vt = np.linalg.svd(np.swapaxes(arms_, 1, 2) @ arms)
    U[..., 2] *= np.linalg.det(U @ Vt)[:, None]  # a rotation, no reflection
    R = U @ Vt
    t = centre_ - (R @ centre[..., None])[..., 0]
    found = extent[:, 1] > _LINE * (target**2).sum(axis=(1, 2))
    return np.asarray(np.concatenate([R, t[..., None]], axis=-1)[found])


def settle(motion: Array, q: Array, i: Array, seen: Array, camera: StereoCamera) -> Array:
    """The motion [R | t] (3, 4) with the least squared errors [px^2] of places seen (n, 3) u, v, d.

    Gauss-Newton from a motion near it; every step takes the ratios anew from the last motion.
    """
    for _ in range(_UPDATES):
        moved, errors = predict(motion[None], q, i, seen, camera)
        J = _by_motion(moved[0], i, camera)
        step, *_ = np.linalg.lstsq(J.reshape(-1, 6), -errors[0].ravel(), rcond=None)
        turn = Rotation.from_rotvec(step[:3]).as_matrix()
        motion = turn @ motion
        motion[:, 3] += step[3:]
        if np.abs(step).max() < _SETTLED:
            break
    return motion


def predict(
    motions: Array, q: Array, i: Array, seen: Array, camera: StereoCamera
) -> tuple[Array, Array]:
    """R q + t i (k, n, 3) under motions (k, 3, 4), and the errors (k, n, 3) [px] of (u, v, d)
    against where points are seen (n, 3); NaN behind the camera."""
    moved = q @ np.swapaxes(motions[:, :, :3], 1, 2) + motions[:, None, :, 3] * i[:, None]
    ratio = np.where(moved[..., 2] > 0, moved[..., 2], np.nan)
    u = camera.fx * moved[..., 0] / ratio + camera.cx
    v = camera.fy * moved[..., 1] / ratio + camera.cy
    d = camera.fx * camera.baseline * i / ratio
    return moved, np.stack([u, v, d], axis=-1) - seen


def _by_motion(moved: Array, i: Array, camera: StereoCamera) -> Array:
    """(n, 3, 6) derivative of (u, v, d) by a rotation vector and a shift after the motion."""
    X, Y, ratio = moved.T
    zero = np.zeros_like(X)
    fx, fy, reach = camera.fx / ratio, camera.fy / ratio, camera.fx * camera.baseline * i / ratio
    by_point = np.stack(
        [
            np.stack([fx, zero, -fx * X / ratio], axis=-1),
            np.stack([zero, fy, -fy * Y / ratio], axis=-1),
            np.stack([zero, zero, -reach / ratio], axis=-1),
        ],
        axis=-2,
    )
    # a rotation moves a point by omega x moved, a shift by i times itself
    by_rotation = np.cross(moved[:, None, :], by_point)
    return np.concatenate([by_rotation, by_point * i[:, None, None]], axis=-1)
