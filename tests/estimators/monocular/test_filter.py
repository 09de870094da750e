"""The filter's mathematics: derivatives, update, frame and covariances, on states made up."""

from dataclasses import replace

import numpy as np

from grouser.estimators.monocular.camera import Matches, innovation, place_covariances, project
from grouser.estimators.monocular.kalman import compose, motion_pose, update
from grouser.estimators.monocular.landmarks import landmarks
from grouser.estimators.monocular.motion_model import moved
from grouser.estimators.monocular.state import HEAD, SlamState, initial_state, planar_covariance
from grouser.geometry import Array, so3_exp, transform
from grouser.geometry import project as planar
from tests.estimators.monocular import point_world as world

T_CAMERA, INTRINSICS = world.CAMERA.T_base_camera, world.INTRINSICS


def some_state(seed: int = 0, n: int = 6, size: float = 1e-3) -> SlamState:
    """Points in view, a motion with all six numbers, a tilted robot, a full covariance."""
    rng = np.random.default_rng(seed)
    size_of_state = HEAD + 3 * n
    A = rng.standard_normal((size_of_state, size_of_state))
    points = np.column_stack(
        [rng.uniform(60, 260, n), rng.uniform(60, 180, n), rng.uniform(0.1, 1.0, n)]
    )
    T = transform(so3_exp(np.array([0.05, -0.04, 0.8])), [1.0, 2.0, 0.1])
    motion = np.array([0.1, 0.08, 0.01, 0.004, 0.006, -0.005])
    covariance = size**2 * (A @ A.T) / size_of_state
    return SlamState(T, np.zeros(5), motion, points, covariance)


def errors(of: SlamState, frm: SlamState) -> Array:
    """The error vector that leads from one state to a near one."""
    dR = of.T_start_base[:3, :3] @ frm.T_start_base[:3, :3].T
    rotation = np.array([dR[2, 1] - dR[1, 2], dR[0, 2] - dR[2, 0], dR[1, 0] - dR[0, 1]]) / 2
    return np.concatenate(
        [
            of.T_start_base[:3, 3] - frm.T_start_base[:3, 3],
            rotation,
            of.constants - frm.constants,
            of.motion - frm.motion,
            (of.points - frm.points).ravel(),
        ]
    )


def shifted(state: SlamState, row: int, step: float) -> SlamState:
    change = np.zeros(len(state.covariance))
    change[row] = step
    return state.corrected(change, state.covariance)


def composed(state: SlamState) -> SlamState:
    return compose(state, project(state, T_CAMERA, INTRINSICS))


def test_the_measurement_has_the_derivatives_of_finite_differences() -> None:
    state = some_state()
    projection = project(state, T_CAMERA, INTRINSICS)
    for row in range(11, len(state.covariance)):
        ahead = project(shifted(state, row, 1e-6), T_CAMERA, INTRINSICS).points
        back = project(shifted(state, row, -1e-6), T_CAMERA, INTRINSICS).points
        slope = (ahead - back) / 2e-6
        told = np.zeros_like(slope)
        if row < HEAD:
            told = projection.by_motion[:, :, row - 11]
        else:
            i, c = divmod(row - HEAD, 3)
            told[i] = projection.by_point[i, :, c]
        np.testing.assert_allclose(slope, told, rtol=1e-5, atol=1e-4)


def test_composition_carries_the_covariance_as_finite_differences_do() -> None:
    state = some_state()
    columns = [
        (
            errors(composed(shifted(state, row, 1e-6)), composed(state))
            - errors(composed(shifted(state, row, -1e-6)), composed(state))
        )
        / 2e-6
        for row in range(len(state.covariance))
    ]
    F = np.array(columns).T
    expected = F @ state.covariance @ F.T
    np.testing.assert_allclose(
        composed(state).covariance, expected, rtol=1e-5, atol=1e-6 * np.abs(expected).max()
    )


def test_composition_moves_the_robot_by_the_motion_and_ends_it() -> None:
    state = some_state()
    after = composed(state)
    np.testing.assert_allclose(after.T_start_base, state.T_start_base @ motion_pose(state.motion))
    assert not after.motion.any()


def test_the_track_model_has_the_derivatives_of_finite_differences() -> None:
    constants = np.array([0.01, -0.02, 0.03, 0.02, 0.0])
    for du in (np.array([0.04, 0.05]), np.array([-0.03, 0.03]), np.array([0.05, 0.05])):
        told = world.TRACKS.predict(du, constants).by_constants
        for k in range(5):
            step = 1e-6 * np.eye(5)[k]
            ahead = world.TRACKS.predict(du, constants + step).mean
            back = world.TRACKS.predict(du, constants - step).mean
            slope = (ahead - back) / 2e-6
            # How drag and outward slip depend on the scales is left out: a share of a share.
            np.testing.assert_allclose(slope[[0, 1]], told[[0, 1], k], rtol=1e-5, atol=1e-8)


def test_the_update_is_the_textbooks() -> None:
    state = some_state()
    projection = project(state, T_CAMERA, INTRINSICS)
    seen = np.array([0, 2, 5])
    places = projection.points[seen, :2] + 0.01 * np.arange(6).reshape(3, 2)
    matches = Matches(seen, places, np.array([0.01, 0.04, 0.02]))
    H = np.zeros((6, len(state.covariance)))
    for k, i in enumerate(seen):
        H[2 * k : 2 * k + 2, 11:HEAD] = projection.by_motion[i, :2]
        H[2 * k : 2 * k + 2, HEAD + 3 * i : HEAD + 3 * i + 3] = projection.by_point[i, :2]
    P = state.covariance
    S = H @ P @ H.T + np.diag(np.repeat(matches.noise, 2))
    K = P @ H.T @ np.linalg.inv(S)
    compared = innovation(state, matches, state, projection)
    np.testing.assert_allclose(compared.covariance, S, rtol=1e-10)
    expected_squares = [
        r @ np.linalg.solve(S[2 * k : 2 * k + 2, 2 * k : 2 * k + 2], r)
        for k, r in enumerate(compared.residual.reshape(-1, 2))
    ]
    np.testing.assert_allclose(compared.squared(), expected_squares)
    spread = place_covariances(state, projection)
    np.testing.assert_allclose(spread[0], S[:2, :2] - 0.01 * np.eye(2), rtol=1e-9)
    change = K @ compared.residual
    after = update(state, compared)
    np.testing.assert_allclose(after.motion, state.motion + change[11:HEAD], rtol=1e-9)
    np.testing.assert_allclose(after.points, state.points + change[HEAD:].reshape(-1, 3), rtol=1e-9)
    np.testing.assert_allclose(after.covariance, P - K @ S @ K.T, atol=1e-12)
    np.testing.assert_array_equal(after.covariance, after.covariance.T)


def test_a_new_point_is_spread_in_the_next_image_as_samples_are() -> None:
    """The ellipse in which a point is sought after its first frame, against Monte Carlo."""
    rng = np.random.default_rng(1)
    inverse_depth, sigma = 0.5, 0.2
    start = initial_state(np.zeros(5))
    state = start.with_points(
        np.array([[240.0, 150.0, inverse_depth]]), np.array([0.3, 0.3, sigma])
    )
    state = moved(state, world.TRACKS.predict(np.array([0.06, 0.06]), np.zeros(5)), 0.0)
    expected = place_covariances(state, project(state, T_CAMERA, INTRINSICS))[0]
    samples = rng.multivariate_normal(np.zeros(HEAD + 3), state.covariance, 4000)
    seen = [
        project(state.corrected(s, state.covariance), T_CAMERA, INTRINSICS).points[0, :2]
        for s in samples
    ]
    np.testing.assert_allclose(
        np.cov(np.array(seen).T), expected, rtol=0.1, atol=0.05 * expected.max()
    )


def test_landmarks_lie_where_and_as_uncertain_as_samples_do() -> None:
    rng = np.random.default_rng(2)
    state = replace(some_state(size=5e-4), motion=np.zeros(6))
    told = landmarks(state, world.CAMERA)
    assert len(told.positions) == len(state.points)
    samples = rng.multivariate_normal(np.zeros(len(state.covariance)), state.covariance, 4000)
    places = np.array(
        [
            landmarks(state.corrected(s, state.covariance), world.CAMERA).positions[0]
            for s in samples
        ]
    )
    scale = told.covariances[0].max()
    np.testing.assert_allclose(np.cov(places.T), told.covariances[0], atol=0.08 * scale)
    np.testing.assert_allclose(places.mean(axis=0), told.positions[0], atol=0.1 * scale**0.5)
    u_v_i = world.seen_from(state.T_start_base, told.positions)
    np.testing.assert_allclose(u_v_i, state.points)


def test_a_point_that_may_be_at_infinity_is_no_landmark() -> None:
    state = initial_state(np.zeros(5)).with_points(
        np.array([[100.0, 100.0, 0.5], [200.0, 100.0, 0.5]]), np.array([0.1, 0.1, 0.1])
    )
    state.covariance[HEAD + 2, HEAD + 2] = 0.2**2
    assert len(landmarks(state, world.CAMERA).positions) == 1


def test_the_planar_covariance_is_that_of_samples() -> None:
    state = some_state(size=0.01)
    rng = np.random.default_rng(3)
    samples = rng.multivariate_normal(np.zeros(len(state.covariance)), state.covariance, 4000)
    poses = [planar(state.corrected(s, state.covariance).T_start_base) for s in samples]
    expected = planar_covariance(state)
    np.testing.assert_allclose(np.cov(np.array(poses).T), expected, atol=0.08 * expected.max())


def test_points_come_and_go_without_a_trace_in_the_others() -> None:
    state = some_state()
    more = state.with_points(np.array([[50.0, 50.0, 1.0]]), np.array([0.1, 0.1, 0.5]))
    back = more.keeping(np.arange(7) < 6)
    np.testing.assert_array_equal(back.covariance, state.covariance)
    assert not more.covariance[:-3, -3:].any()
