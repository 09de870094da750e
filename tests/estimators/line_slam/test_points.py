"""The point model of paper 2: eq. (11) against finite differences, and what is printed."""

import numpy as np
import pytest

from grouser.estimators.line_slam.points import polar, polar_jacobians, seen_at
from grouser.geometry import Array, wrap

POINTS = np.random.default_rng(0).uniform(-20, 20, (50, 2))
POSE = np.array([1.0, -2.0, 0.7])


def differences(points: Array, pose: Array) -> Array:
    """(n, 2, 5) derivative of `polar`, by central differences."""
    columns = []
    for k in range(5):
        step = np.zeros(5)
        step[k] = 1e-6
        ahead = polar(points + step[3:], pose + step[:3])
        back = polar(points - step[3:], pose - step[:3])
        change = ahead - back
        change[:, 1] = wrap(change[:, 1])
        columns.append(change / 2e-6)
    return np.stack(columns, axis=-1)


def test_the_jacobian_is_the_derivative() -> None:
    H = polar_jacobians(POINTS, POSE)
    np.testing.assert_allclose(H, differences(POINTS, POSE), atol=1e-6)


def test_the_printed_one_differs_in_two_entries() -> None:
    off = polar_jacobians(POINTS, POSE, printed=True) - differences(POINTS, POSE)
    wrong = np.abs(off).max(axis=0) > 1e-3
    assert np.argwhere(wrong).tolist() == [[1, 3], [1, 4]]


def test_a_point_that_was_seen_is_where_it_was_seen() -> None:
    for point, measured in zip(POINTS, polar(POINTS, POSE), strict=True):
        again, by_pose, by_measured = seen_at(measured, POSE)
        assert again == pytest.approx(point)
        # The derivatives are those of the inverse function.
        H = polar_jacobians(point[None], POSE)[0]
        np.testing.assert_allclose(H[:, 3:] @ by_measured, np.eye(2), atol=1e-9)
        np.testing.assert_allclose(H[:, 3:] @ by_pose + H[:, :3], 0, atol=1e-9)


def test_a_point_at_the_robot_has_finite_derivatives() -> None:
    assert np.isfinite(polar_jacobians(POSE[None, :2], POSE)).all()
