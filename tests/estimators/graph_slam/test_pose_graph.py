"""The graph against brute force: its optimum, its covariances, and how little a lie bends it."""

import numpy as np
import pytest

from grouser.estimators.graph_slam.pose_graph import PoseGraph
from grouser.geometry import Array, between, between_jacobians, compose, wrap

STEP = np.array([0.5, 0.0, 2 * np.pi / 24])
SIGMA = np.array([0.03, 0.02, 0.01])
LOOP = np.diag([1e4, 1e4, 1e5])


def driven(rng: np.random.Generator, n: int, *, closed: bool = True) -> tuple[PoseGraph, Array]:
    """A graph of two rounds, closed after the first or not, and the true poses (n + 1, 3)."""
    graph, truth = PoseGraph(), [np.zeros(3)]
    for _ in range(n):
        truth.append(compose(truth[-1], STEP))
        measured = compose(STEP, rng.normal(size=3) * SIGMA)
        graph.append(compose(graph.poses[-1], measured), measured, np.diag(SIGMA**2))
        new = len(graph) - 1
        if closed and new >= 24 and new % 3 == 0:
            seen = between(truth[new - 24], truth[new]) + rng.normal(size=3) / np.sqrt(
                np.diag(LOOP)
            )
            graph.close(new - 24, new, seen, LOOP)
    return graph, np.array(truth)


def dense(graph: PoseGraph) -> tuple[Array, Array]:
    """J^T W J without the first pose, and J^T W e, edge by edge."""
    n = len(graph)
    H, b = np.zeros((3 * n, 3 * n)), np.zeros(3 * n)
    loops = {(i, j): measured for i, j, measured in graph.closures}
    edges = [((k, k + 1), graph._measured[_at(graph, k)], np.diag(SIGMA**-2)) for k in range(n - 1)]
    for (i, j), measured, W in [*edges, *((ends, m, LOOP) for ends, m in loops.items())]:
        J = np.zeros((3, 3 * n))
        J[:, 3 * i : 3 * i + 3], J[:, 3 * j : 3 * j + 3] = between_jacobians(
            graph.poses[i], graph.poses[j]
        )
        e = between(graph.poses[i], graph.poses[j]) - measured
        e[2] = wrap(e[2])
        H += J.T @ W @ J
        b += J.T @ W @ e
    return H[3:, 3:], b[3:]


def _at(graph: PoseGraph, k: int) -> int:
    return graph._ends.index((k, k + 1))


def test_the_optimum_has_no_slope() -> None:
    graph, truth = driven(np.random.default_rng(0), 48)
    before = np.abs((graph.poses - truth)[:, :2]).max()
    graph.optimise()
    H, b = dense(graph)
    assert np.abs(np.linalg.solve(H, b)).max() < 1e-5
    assert np.abs((graph.poses - truth)[:, :2]).max() < before


def test_covariances_are_those_of_the_dense_inverse() -> None:
    graph, _ = driven(np.random.default_rng(1), 40)
    graph.optimise()
    P = np.linalg.inv(dense(graph)[0])
    np.testing.assert_allclose(graph.covariance, P[-3:, -3:], rtol=1e-4, atol=1e-9)
    i = 9
    by_i, by_last = between_jacobians(graph.poses[i], graph.poses[-1])
    J = np.zeros((3, len(P)))
    J[:, 3 * i - 3 : 3 * i], J[:, -3:] = by_i, by_last
    np.testing.assert_allclose(graph.relative_covariance(i), J @ P @ J.T, rtol=1e-4, atol=1e-9)


def test_covariances_go_on_with_the_way() -> None:
    """Steps after the graph was solved count, without solving it again."""
    graph, _ = driven(np.random.default_rng(2), 30, closed=False)
    unsolved = graph.covariance.copy()
    np.testing.assert_allclose(unsolved, np.linalg.inv(dense(graph)[0])[-3:, -3:], rtol=1e-6)
    graph.optimise()
    for _ in range(5):
        graph.append(compose(graph.poses[-1], STEP), STEP, np.diag(SIGMA**2))
    P = np.linalg.inv(dense(graph)[0])
    np.testing.assert_allclose(graph.covariance, P[-3:, -3:], rtol=1e-6)
    by_i, by_last = between_jacobians(graph.poses[4], graph.poses[-1])
    J = np.zeros((3, len(P)))
    J[:, 9:12], J[:, -3:] = by_i, by_last
    np.testing.assert_allclose(graph.relative_covariance(4), J @ P @ J.T, rtol=1e-5, atol=1e-9)


def test_the_covariance_is_as_large_as_the_errors() -> None:
    rng, nees = np.random.default_rng(3), []
    for _ in range(60):
        graph, truth = driven(rng, 40)
        graph.optimise()
        e = graph.poses[-1] - truth[-1]
        e[2] = wrap(e[2])
        nees.append(e @ np.linalg.solve(graph.covariance, e))
    assert np.mean(nees) == pytest.approx(3, abs=0.9)


def test_a_wrong_loop_bends_little() -> None:
    graph, truth = driven(np.random.default_rng(4), 48)
    graph.optimise()
    right = np.abs((graph.poses - truth)[:, :2]).max()
    graph.close(3, 40, np.array([4.0, -3.0, 1.0]), LOOP)
    graph.optimise()
    assert np.abs((graph.poses - truth)[:, :2]).max() < right + 0.05


def test_a_single_pose_is_where_it_is() -> None:
    graph = PoseGraph()
    graph.optimise()
    assert not graph.poses.any() and not graph.covariance.any() and graph.closures == []
