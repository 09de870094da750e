"""The singularity-free measurement function against SE(3) in metres, and its derivatives."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from grouser.estimators.visual.motion import (
    camera_motion,
    chassis_pose,
    intrinsics,
    measure,
    predict_points,
)
from grouser.geometry import Array, rotate
from grouser.rig import StereoCamera, camera_mount
from tests.estimators.visual.clouds import chassis, moved, points_of, scattered, seen, six, stereo

FREE = np.array([0.1, 0.2, -0.03, 0.02, 0.04, -0.05])
MOUNT = camera_mount(0.2, -0.1, 0.4, roll=0.1, pitch=0.3, yaw=-0.05)

angles = st.floats(-0.4, 0.4)
lengths = st.floats(-0.4, 0.4)
mounts = st.builds(camera_mount, lengths, lengths, lengths, roll=angles, pitch=angles, yaw=angles)
motions = st.tuples(angles, lengths, lengths, lengths, angles, angles).map(np.array)


def measured(w: Array, motion: Array, camera: StereoCamera) -> tuple[Array, Array, Array]:
    """p (3,), dp/dw (3, 3) and dp/dmotion (3, 6) of one point in front of the camera."""
    p, Jw, Jm = np.empty(3), np.empty((3, 3)), np.empty((3, 6))
    moving = camera_motion(motion, camera.T_base_camera)
    assert measure(w, *moving, intrinsics(camera), p, Jw, Jm)
    return p, Jw, Jm


def predicted(w: Array, motion: Array, camera: StereoCamera) -> Array:
    """(n, 3) where points are expected after a motion that is known."""
    known, exact = np.zeros((6, 6)), np.zeros(6)
    p, _, _ = predict_points(w, motion, known, camera.T_base_camera, intrinsics(camera), exact)
    return np.asarray(p)


@settings(max_examples=60, deadline=None)
@given(mounts, motions, st.integers(0, 1000), st.floats(200, 400))
def test_points_move_as_in_space(mount: Array, motion: Array, seed: int, fy: float) -> None:
    camera = stereo(mount, fy=fy)
    points = scattered(np.random.default_rng(seed), 20, camera, depth=(3.0, 20.0))
    now = moved(points, motion, mount)
    ahead = now[:, 2] > 0.5
    expected = seen(now[ahead], camera)
    found = predicted(seen(points, camera)[ahead], motion, camera)
    np.testing.assert_allclose(found, expected, rtol=1e-10, atol=1e-9)


def test_a_point_at_infinity_only_turns() -> None:
    camera = stereo(MOUNT)
    ray = np.array([0.1, -0.2, 1.0])
    w = np.array([[camera.cx + camera.fx * 0.1, camera.cy - camera.fy * 0.2, 0.0]])
    far = moved(1e12 * ray[None], FREE, MOUNT)
    np.testing.assert_allclose(predicted(w, FREE, camera), seen(far, camera), atol=1e-7)
    assert predicted(w, FREE, camera)[0, 2] == 0.0


@pytest.mark.parametrize("motion", [FREE, np.zeros(6), six(0.3, 0.0), six(0.0, -0.4)])
@pytest.mark.parametrize("disparity", [0.0, 0.7, 25.0])
def test_derivatives_of_a_measurement(motion: Array, disparity: float) -> None:
    camera, h = stereo(MOUNT, fy=300.0), 1e-6
    w = np.array([200.0, 90.0, disparity])
    _, Jw, Jm = measured(w, motion, camera)
    for k in range(3):
        step = h * np.eye(3)[k]
        ahead, back = measured(w + step, motion, camera)[0], measured(w - step, motion, camera)[0]
        assert np.abs(Jw[:, k] - (ahead - back) / (2 * h)).max() < 1e-6
    for k in range(6):
        step = h * np.eye(6)[k]
        ahead, back = measured(w, motion + step, camera)[0], measured(w, motion - step, camera)[0]
        assert np.abs(Jm[:, k] - (ahead - back) / (2 * h)).max() < 1e-6 * max(1, np.abs(Jm).max())


@settings(max_examples=40, deadline=None)
@given(mounts, motions)
def test_derivatives_of_the_camera_motion(mount: Array, motion: Array) -> None:
    mount, h = stereo(mount).T_base_camera, 1e-6
    _, _, dA, db = camera_motion(motion, mount)
    for k in range(6):
        A, b, _, _ = camera_motion(motion + h * np.eye(6)[k], mount)
        A_, b_, _, _ = camera_motion(motion - h * np.eye(6)[k], mount)
        assert np.abs(dA[k] - (A - A_) / (2 * h)).max() < 1e-8
        assert np.abs(db[k] - (b - b_) / (2 * h)).max() < 1e-8


@settings(max_examples=40, deadline=None)
@given(mounts, motions)
def test_the_chassis_pose_and_the_camera_motion_are_one_motion(mount: Array, motion: Array) -> None:
    turn, chord, side, height, roll, pitch = motion
    planar = np.append(rotate(turn / 2, [chord, side]), turn)
    T = chassis_pose(planar, height, roll, pitch)
    np.testing.assert_allclose(T, chassis(motion), atol=1e-15)
    A, b, _, _ = camera_motion(motion, stereo(mount).T_base_camera)
    expected = np.linalg.inv(T @ mount) @ mount
    np.testing.assert_allclose(A, expected[:3, :3], atol=1e-14)
    np.testing.assert_allclose(b, expected[:3, 3], atol=1e-14)


def test_the_predicted_covariance_agrees_with_monte_carlo() -> None:
    camera, rng, draws = stereo(MOUNT), np.random.default_rng(0), 5000
    root = 0.004 * np.tril(rng.normal(size=(6, 6)))
    noise = np.array([0.2, 0.3, 0.1, 0.4, 0.25, 0.3]) ** 2
    w = np.array([[210.0, 150.0, 12.0]])
    mean, covariance, _ = predict_points(
        w, FREE, root @ root.T, camera.T_base_camera, intrinsics(camera), noise
    )
    drawn = np.empty((draws, 3))
    noisy = w + rng.normal(size=(draws, 3)) * np.sqrt(noise[:3])
    points = points_of(noisy, camera)
    for i in range(draws):
        motion = FREE + root @ rng.normal(size=6)
        drawn[i] = seen(moved(points[i : i + 1], motion, MOUNT), camera)[0]
    drawn += rng.normal(size=(draws, 3)) * np.sqrt(noise[3:])
    whitened = np.linalg.solve(np.linalg.cholesky(covariance[0]), (drawn - mean[0]).T)
    np.testing.assert_allclose(np.cov(whitened), np.eye(3), atol=0.07)


def test_a_point_that_falls_behind_the_camera_is_nan_and_no_other() -> None:
    camera = stereo()
    near, far = seen(np.array([[0.1, 0.1, 0.5], [0.1, 0.1, 3.0]]), camera)
    p, covariance, by_point = predict_points(
        np.array([near, far]),
        six(0.0, 1.0),
        np.eye(6) * 1e-6,
        camera.T_base_camera,
        intrinsics(camera),
        np.full(6, 0.1),
    )
    for result in (p, covariance, by_point):
        assert np.isnan(result[0]).all() and np.isfinite(result[1]).all()
