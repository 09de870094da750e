"""Motion as a homography of disparity space: exact, and better for updating the ratios."""

import numpy as np
from scipy.spatial.transform import Rotation

from grouser.estimators.visual.disparity_space import DisparitySpace, align, predict, settle
from grouser.estimators.visual.motion import camera_motion
from grouser.estimators.visual.rays import disparity_rays
from grouser.geometry import Array
from tests.estimators.visual.clouds import MOUNTS, matched, near_zero, stereo

CAMERA = stereo(MOUNTS["everything"])
MOTION = np.array([0.06, 0.25, -0.03, 0.02, 0.01, -0.02])
A, B, _, _ = camera_motion(MOTION, CAMERA.T_base_camera)
TRUTH: Array = np.column_stack([A, B])


def told(rng: np.random.Generator, n: int, sigma: float) -> tuple[Array, Array, Array, Array]:
    """Rays and inverse depths before and after."""
    matches = matched(rng, CAMERA, MOTION, n=n, noise=np.full(6, sigma**2))
    return *disparity_rays(matches.reference, CAMERA), *disparity_rays(matches.current, CAMERA)


def test_samples_are_aligned_exactly_and_by_themselves() -> None:
    q, i, q_, i_ = (
        part.reshape(20, 3, *part.shape[1:]) for part in told(np.random.default_rng(0), 60, 0.0)
    )
    motions = align(q, i, q_, i / i_)
    np.testing.assert_allclose(motions, np.tile(TRUTH, (20, 1, 1)), atol=1e-9)
    assert (np.linalg.det(motions[:, :, :3]) > 0).all()


def test_samples_that_fix_no_motion_are_left_out() -> None:
    q, i, q_, i_ = (
        part.reshape(4, 3, *part.shape[1:]) for part in told(np.random.default_rng(1), 12, 0.0)
    )
    for part in (q, i, q_, i_):
        part[2] = part[2, 0]
    assert len(align(q, i, q_, i / i_)) == 3


def test_updated_ratios_are_better_than_measured_ones() -> None:
    """Wu's point: a ratio of disparities is many times as noisy as a place in the image."""
    once, updated = [], []
    for rng in np.random.default_rng(2).spawn(60):
        matches = matched(rng, CAMERA, MOTION, n=40, noise=np.full(6, 0.3**2))
        q, i = disparity_rays(matches.reference, CAMERA)
        q_, i_ = disparity_rays(matches.current, CAMERA)
        motion = align(q[None], i[None], q_[None], (i / i_)[None])[0]
        once.append(motion - TRUTH)
        updated.append(settle(motion, q, i, matches.current, CAMERA) - TRUTH)
    for part in (slice(0, 3), slice(3, 4)):  # rotation, translation
        error, error_ = (np.sqrt(np.mean(np.square(e)[:, :, part])) for e in (once, updated))
        assert error_ < 0.7 * error


def test_settling_finds_the_least_squares() -> None:
    """No small motion after it makes the sum of squared errors smaller."""
    rng = np.random.default_rng(4)
    matches = matched(rng, CAMERA, MOTION, n=40, noise=np.full(6, 0.3**2))
    q, i = disparity_rays(matches.reference, CAMERA)
    settled = settle(TRUTH, q, i, matches.current, CAMERA)

    def cost(step: Array) -> float:
        turned = Rotation.from_rotvec(step[:3]).as_matrix() @ settled
        turned[:, 3] += step[3:]
        return float((predict(turned[None], q, i, matches.current, CAMERA)[1] ** 2).sum())

    least = cost(np.zeros(6))
    for step in np.concatenate([np.eye(6), -np.eye(6)]) * 1e-5:
        assert cost(step) > least
    assert np.abs(settled[:, :3].T @ settled[:, :3] - np.eye(3)).max() < 1e-12


def test_noise_is_judged_alike_near_and_far() -> None:
    """In metres the far points would be wrong by a hundred times what the near ones are."""
    kept = {}
    for depth in ((0.8, 1.5), (8.0, 12.0)):
        shares = []
        for rng in np.random.default_rng(3).spawn(20):
            matches = matched(rng, CAMERA, MOTION, noise=np.full(6, 0.2**2), depth=depth)
            found = DisparitySpace(CAMERA).solve(matches, near_zero(1, 1, 1, 1), rng)
            assert found is not None
            shares.append(found.inliers.mean())
        kept[depth] = np.mean(shares)
    near, far = kept.values()
    assert near > 0.93 and far > 0.93
