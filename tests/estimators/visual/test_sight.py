"""One look back: from two stereo pairs to a motion with a covariance, or to none."""

import numpy as np
import pytest

from grouser.estimators.base import Observation
from grouser.estimators.synthetic_drive import RIG, synthetic_drive
from grouser.estimators.visual.five_point import FivePointRansac
from grouser.estimators.visual.frontend import FrontendOptions
from grouser.estimators.visual.image_frontend import ImageFrontend
from grouser.estimators.visual.matching import MatchingOptions, PixelNoise
from grouser.estimators.visual.one_point import OnePointRansac
from grouser.estimators.visual.planar_motion import pose_motion
from grouser.estimators.visual.prior import ChassisPrior
from grouser.estimators.visual.sight import Expectation, KeyframeSight, Sight
from grouser.geometry import Array, between, rotate
from grouser.rig import StereoCamera

DRIVE = synthetic_drive(frames=31, blackout=range(10, 25))
assert RIG.stereo is not None
CAMERA: StereoCamera = RIG.stereo


def images() -> ImageFrontend:
    return ImageFrontend(
        CAMERA, options=FrontendOptions(), matching=MatchingOptions(), noise=PixelNoise()
    )


def look(
    later: int | Observation,
    expected: Array,
    *,
    sigma: float = 0.02,
    solver: type[OnePointRansac] | type[FivePointRansac] = OnePointRansac,
) -> Sight:
    """From frame 2 to a later one, or to other images."""
    frontend = images()
    keyframe = frontend.make_keyframe(frontend.extract(DRIVE.observations[2]))
    now = frontend.extract(DRIVE.observations[later] if isinstance(later, int) else later)
    sight = KeyframeSight(CAMERA, frontend, solver(CAMERA))
    on_an_arc = np.append(pose_motion(expected)[:2], 0.0)  # as the drive is, whatever is expected
    prior = ChassisPrior().about(on_an_arc, 0.002, np.zeros(6))
    expectation = Expectation(expected, np.eye(3) * sigma**2)
    return sight.look(keyframe, now, expectation, prior, np.random.default_rng(0))


def truth(later: int) -> Array:
    return between(DRIVE.poses[2], DRIVE.poses[later])


@pytest.mark.parametrize("solver", [OnePointRansac, FivePointRansac])
@pytest.mark.parametrize("later", [3, 5, 8])
def test_the_motion_is_seen_to_millimetres(
    later: int, solver: type[OnePointRansac] | type[FivePointRansac]
) -> None:
    sight = look(later, truth(later) + [0.02, 0.01, -0.02], solver=solver)
    seen = sight.planar()
    error = seen.pose - truth(later)
    assert np.abs(error[:2]).max() < 0.006 and abs(error[2]) < 0.002
    assert error @ np.linalg.solve(seen.covariance, error) < 16.3  # chi-square of 3 at 99.9 %
    height, roll, pitch = sight.out_of_plane()
    assert abs(height) < 0.005 and abs(roll) < 0.005 and abs(pitch) < 0.005
    assert sight.diagnostics["inliers"] > 40


@pytest.mark.parametrize("sigma", [0.005, 0.1])
def test_what_a_narrow_search_misses_a_wide_one_finds(sigma: float) -> None:
    """Tracks that slip are sure of what is wrong; nothing but the images says so."""
    found = look(6, truth(6) + [0.0, 0.0, 0.12], sigma=sigma)  # 31 px away
    assert np.abs(found.planar().pose - truth(6)).max() < 0.006
    assert found.diagnostics["inliers"] > 40


@pytest.mark.parametrize("later", [3, 8])
def test_after_a_wide_search_a_narrow_one_finds_what_was_ambiguous(later: int) -> None:
    known = look(later, truth(later)).diagnostics["candidates"]
    found = look(later, truth(later) + [0.0, 0.0, 0.12], sigma=0.1)
    assert found.diagnostics["candidates"] > 0.95 * known
    assert np.abs(found.planar().pose - truth(later)).max() < 0.004


def test_in_the_dark_there_is_no_motion_and_nothing_to_tell() -> None:
    blind = look(12, truth(5))
    assert blind.motion is None and blind.diagnostics["inliers"] == 0
    assert blind.out_of_plane() == (0.0, 0.0, 0.0)
    with pytest.raises(ValueError, match="a sight without a motion has no planar part"):
        blind.planar()


@pytest.mark.parametrize("sigma", [0.005, 0.1])
def test_another_scene_is_no_motion(sigma: float) -> None:
    size = (CAMERA.height, CAMERA.width, 1)
    noise = np.random.default_rng(1).integers(0, 256, size, dtype=np.uint8)
    assert look({"left": noise, "right": noise}, np.zeros(3), sigma=sigma).motion is None


def test_the_planar_part_carries_covariance_and_offset_through() -> None:
    """By Monte Carlo: motions drawn from the sight's covariance, as poses."""
    rng = np.random.default_rng(3)
    root = np.tril(rng.normal(size=(6, 6))) * 0.003
    motion, offset = np.array([0.2, 0.25, -0.02, 0.01, 0.0, 0.0]), 0.01 * rng.normal(size=6)
    seen = Sight(motion, root @ root.T, offset, {}).planar()
    drawn = motion[:3] + (rng.normal(size=(20000, 6)) @ root.T)[:, :3]
    poses = np.column_stack([rotate(drawn[:, 0] / 2, drawn[:, 1:3]), drawn[:, 0]])
    whitened = np.linalg.solve(np.linalg.cholesky(seen.covariance), (poses - seen.pose).T)
    np.testing.assert_allclose(np.cov(whitened), np.eye(3), atol=0.04)
    h = 1e-6
    ahead = Sight(motion + h * offset, root, offset, {}).planar().pose
    np.testing.assert_allclose(seen.by_disparity, (ahead - seen.pose) / h, atol=1e-6)


def test_a_widened_prior_believes_the_same_less_surely() -> None:
    prior = ChassisPrior().about(np.array([0.1, 0.2, 0.01]), 0.002, np.zeros(6))
    wider = prior.widened(np.full(6, 0.03))
    np.testing.assert_array_equal(wider.mean, prior.mean)
    np.testing.assert_allclose(wider.sigma**2, prior.sigma**2 + 0.03**2)
