"""The sparse kernels against dense algebra on random covariances."""

import numpy as np
import pytest

from grouser.estimators.line_slam.sparse_update import (
    absorb,
    augment,
    block,
    correct,
    propagate,
    remove,
    shear,
)
from grouser.geometry import Array

N, ROOM = 11, 16


@pytest.fixture
def P() -> Array:
    A = np.random.default_rng(1).normal(size=(N, N))
    return np.asarray(A @ A.T + np.eye(N))


def upper(P: Array) -> Array:
    """A larger buffer of which only the upper triangle means anything."""
    out = np.full((ROOM, ROOM), np.nan)
    rows, columns = np.triu_indices(len(P))
    out[rows, columns] = P[rows, columns]
    return out


def full(buffer: Array, n: int = N) -> Array:
    return np.asarray(block(buffer, np.arange(n)))


def test_propagation(P: Array) -> None:
    rng = np.random.default_rng(2)
    F, Q = rng.normal(size=(4, 4)), np.diag(rng.uniform(0, 1, 4))
    buffer = upper(P)
    propagate(buffer, N, F, Q)
    whole = np.eye(N)
    whole[:4, :4] = F
    expected = whole @ P @ whole.T
    expected[:4, :4] += Q
    np.testing.assert_allclose(full(buffer), expected, atol=1e-12)


def test_corrections_one_after_another_are_those_of_the_dense_filter(P: Array) -> None:
    rng = np.random.default_rng(3)
    buffer, W = upper(P), np.empty((6, ROOM))
    mean, expected_mean, expected = np.zeros(N), np.zeros(N), P
    for used in (0, 2, 4):
        indices = np.array([0, 2, 3 + used, 4 + used])
        H = np.zeros((2, N))
        H[:, indices] = rng.normal(size=(2, 4))
        R, nu = np.diag(rng.uniform(0.1, 1, 2)), rng.normal(size=2)
        change, d2 = correct(buffer, N, W, used, indices, H[:, indices], R, nu, np.inf)
        S = H @ expected @ H.T + R
        K = expected @ H.T @ np.linalg.inv(S)
        joseph = np.eye(N) - K @ H
        assert d2 == pytest.approx(nu @ np.linalg.solve(S, nu))
        mean, expected_mean = mean + change, expected_mean + K @ nu
        expected = joseph @ expected @ joseph.T + K @ R @ K.T
    absorb(buffer, N, W, 6)
    np.testing.assert_allclose(mean, expected_mean, atol=1e-12)
    np.testing.assert_allclose(full(buffer), expected, atol=1e-12)


def test_what_the_gate_keeps_out_changes_nothing(P: Array) -> None:
    buffer, W = upper(P), np.full((2, ROOM), 7.0)
    H, R = np.eye(2), np.eye(2)
    change, d2 = correct(buffer, N, W, 0, np.array([0, 5]), H, R, np.array([50.0, 0.0]), 9.21)
    assert d2 > 9.21 and not change.any() and (W == 7.0).all()


def test_augmentation(P: Array) -> None:
    G, noise = np.random.default_rng(4).normal(size=(2, 3)), np.array([[2.0, 0.5], [0.5, 1.0]])
    buffer = upper(P)
    augment(buffer, N, np.array([0, 1, 2]), G, noise)
    whole = np.vstack([np.eye(N), np.zeros((2, N))])
    whole[N:, :3] = G
    expected = whole @ P @ whole.T
    expected[N:, N:] += noise
    np.testing.assert_allclose(full(buffer, N + 2), expected, atol=1e-12)


@pytest.mark.parametrize("at", [3, 5, 9])
def test_removal(P: Array, at: int) -> None:
    buffer = upper(P)
    remove(buffer, N, at)
    kept = np.delete(np.arange(N), [at, at + 1])
    np.testing.assert_array_equal(full(buffer, N - 2), P[np.ix_(kept, kept)])


def test_shear(P: Array) -> None:
    U = np.random.default_rng(5).normal(size=(N, 3))
    buffer = upper(P)
    shear(buffer, N, 3, U)
    M = np.eye(N)
    M[:, :3] += U
    np.testing.assert_allclose(full(buffer), M @ P @ M.T, atol=1e-11)
