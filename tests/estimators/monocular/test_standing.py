"""Both ends of a motion that may not have been, and motions one after the other."""

from dataclasses import replace

import numpy as np

from grouser.estimators.monocular.kalman import motion_pose
from grouser.estimators.monocular.motion_model import Motion
from grouser.estimators.monocular.standing import between_both, then, worth_telling
from grouser.estimators.monocular.state import initial_state, planar_covariance
from grouser.geometry import Array, compose, project, wrap
from tests.estimators.monocular import point_world as world

CONSTANTS = np.array([0.01, -0.02, 0.03, 0.02, 0.01])
FIRST, SECOND = np.array([0.04, 0.07]), np.array([0.06, 0.03])


def told(du: Array, constants: Array = CONSTANTS) -> Motion:
    return world.TRACKS.predict(du, constants)


def test_motions_follow_each_other_as_poses_do() -> None:
    both = then(told(FIRST), told(SECOND))
    poses = [project(motion_pose(m.mean)) for m in (told(FIRST), told(SECOND), both)]
    np.testing.assert_allclose(compose(poses[0], poses[1]), poses[2], atol=1e-12)


def test_their_noise_is_that_of_samples() -> None:
    rng, first, second = np.random.default_rng(0), told(FIRST), told(SECOND)
    samples = []
    for _ in range(4000):
        a, b = (
            replace(m, mean=rng.multivariate_normal(m.mean, m.covariance)) for m in (first, second)
        )
        samples.append(then(a, b).mean[:3])
    expected = then(first, second).covariance[:3, :3]
    whitened = np.linalg.solve(np.linalg.cholesky(expected), np.array(samples).T)
    np.testing.assert_allclose(np.cov(whitened), np.eye(3), atol=0.1)


def test_constant_errors_go_through_both() -> None:
    none = np.zeros(5)  # elsewhere the model leaves out what drag and slip owe to the scales
    by_constants = then(told(FIRST, none), told(SECOND, none)).by_constants
    for k, step in enumerate(1e-6 * np.eye(5)):
        ahead = then(told(FIRST, step), told(SECOND, step)).mean
        back = then(told(FIRST, -step), told(SECOND, -step)).mean
        slope = (ahead - back) / 2e-6
        np.testing.assert_allclose(slope[:3], by_constants[:3, k], rtol=1e-5, atol=1e-7)


def test_midway_both_ends_are_one_sigma_away_and_the_truth_between_them_nearer() -> None:
    motion = told(FIRST)
    for _ in range(30):
        motion = then(motion, told(FIRST))
    state = replace(initial_state(world.CONSTANT_SIGMAS), T_start_base=np.eye(4))
    midway = between_both(state, motion, 0.0)
    pose, covariance = project(midway.T_start_base), planar_covariance(midway)
    for end in (np.zeros(3), project(motion_pose(motion.mean))):
        error = np.append(end[:2] - pose[:2], wrap(end[2] - pose[2]))
        assert error @ np.linalg.solve(covariance, error) < 3.0
    assert np.sqrt(covariance[2, 2]) > 0.9 * abs(wrap(motion.mean[0])) / 2


def test_what_is_too_small_to_be_missed_is_not_missed() -> None:
    assert worth_telling(told(np.array([0.04, 0.04])))
    assert worth_telling(told(np.array([-0.02, 0.02])))
    assert not worth_telling(told(np.array([0.004, 0.005])))
