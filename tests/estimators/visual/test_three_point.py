"""Poses of three points: the right one of P3P's four, sample by sample."""

import numpy as np

from grouser.estimators.visual.rays import disparity_rays
from grouser.estimators.visual.three_point import poses_of_three
from grouser.geometry import Array, inverse_transform
from tests.estimators.visual.clouds import chassis, matched, stereo

CAMERA = stereo()
MOTION = np.array([0.06, 0.25, -0.03, 0.02, 0.01, -0.02])
TRUTH: Array = (
    inverse_transform(CAMERA.T_base_camera)
    @ inverse_transform(chassis(MOTION))
    @ CAMERA.T_base_camera
)


def told(number: int) -> list[Array]:
    """Rays and inverse depths of samples of three, before and after."""
    matches = matched(np.random.default_rng(0), CAMERA, MOTION, n=3 * number)
    parts = [disparity_rays(w, CAMERA) for w in (matches.reference, matches.current)]
    return [part.reshape(number, 3, *part.shape[1:]) for pair in parts for part in pair]


def test_of_the_four_solutions_the_disparities_choose_the_right_one() -> None:
    R, t = poses_of_three(*told(200))
    assert len(R) == 200
    right = np.abs(R - TRUTH[:3, :3]).max(axis=(1, 2)) < 1e-6
    assert right.mean() > 0.98  # a sample that two solutions fit is told from noise by others
    np.testing.assert_allclose(t[right], np.tile(TRUTH[:3, 3], (right.sum(), 1)), atol=1e-6)


def test_samples_in_a_plane_with_the_eye_give_no_pose_and_leave_the_others_theirs() -> None:
    rays, inverse, rays_, inverse_ = told(5)
    rays[1, 2] = (rays[1, 0] + rays[1, 1]) / 2
    rays[3] = rays[3, 0]
    R, _ = poses_of_three(rays, inverse, rays_, inverse_)
    assert len(R) == 3
    np.testing.assert_allclose(R, np.tile(TRUTH[:3, :3], (3, 1, 1)), atol=1e-6)
    none, shifts = poses_of_three(rays[3:4], inverse[3:4], rays_[3:4], inverse_[3:4])
    assert none.shape == (0, 3, 3) and shifts.shape == (0, 3)
