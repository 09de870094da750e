"""The errors of matches under motions are chi-square of three, and infinite behind the camera."""

import numpy as np
from scipy import stats

from grouser.estimators.visual.agreement import squared_errors
from grouser.estimators.visual.motion import intrinsics, predict_points
from grouser.geometry import Array
from grouser.rig import camera_mount
from tests.estimators.visual.clouds import matched, six, stereo

CAMERA = stereo(camera_mount(0.2, -0.1, 0.4, pitch=0.3))
NOISE = np.array([0.1, 0.2, 0.3, 0.15, 0.25, 0.2]) ** 2
MOTION = six(0.05, 0.2, 0.01, 0.02, 0.01, -0.02)


def errors(motions: Array, reference: Array, current: Array, slack: Array) -> Array:
    noise = np.tile(NOISE, (len(reference), 1))
    mount, camera = CAMERA.T_base_camera, intrinsics(CAMERA)
    return np.asarray(squared_errors(motions, reference, current, noise, slack, mount, camera))


def test_they_are_the_squared_distances_from_the_prediction_by_its_covariance() -> None:
    rng = np.random.default_rng(0)
    matches = matched(rng, CAMERA, MOTION, n=50, noise=NOISE, outliers=10)
    motions = MOTION + rng.normal(0, 0.01, (4, 6))
    slack = np.array([0.0, 0.0, 0.01, 0.01, 0.003, 0.003]) ** 2
    told = errors(motions, matches.reference, matches.current, slack)
    for motion, row in zip(motions, told, strict=True):
        predicted, S, _ = predict_points(
            matches.reference,
            motion,
            np.diag(slack),
            CAMERA.T_base_camera,
            intrinsics(CAMERA),
            NOISE,
        )
        r = matches.current - predicted
        expected = np.einsum("ni,nij,nj->n", r, np.linalg.inv(S), r)
        np.testing.assert_allclose(row, expected, rtol=1e-9)


def test_under_the_true_motion_they_are_chi_square_of_three_degrees() -> None:
    matches = matched(np.random.default_rng(1), CAMERA, MOTION, n=3000, noise=NOISE)
    told = errors(MOTION[None], matches.reference, matches.current, np.zeros(6))[0]
    assert stats.kstest(told, stats.chi2(3).cdf).pvalue > 1e-3


def test_what_a_motion_leaves_open_is_no_error() -> None:
    """A chassis that pitched, judged by a motion that does not, with pitch among the slack."""
    rng, told = np.random.default_rng(2), []
    for _ in range(300):
        pitched = six(0.05, 0.2, 0.0, 0.0, 0.0, rng.normal(0, 0.01))
        matches = matched(rng, CAMERA, pitched, n=1, noise=NOISE)
        slack = np.array([0, 0, 0, 0, 0, 0.01]) ** 2
        flat = six(0.05, 0.2)[None]
        told.append(errors(flat, matches.reference, matches.current, slack)[0, 0])
    assert stats.kstest(told, stats.chi2(3).cdf).pvalue > 1e-3


def test_behind_the_camera_they_are_infinite() -> None:
    matches = matched(np.random.default_rng(3), CAMERA, MOTION, n=20)
    beyond = errors(six(0.0, 20.0)[None], matches.reference, matches.current, np.zeros(6))
    assert np.isinf(beyond).all()
