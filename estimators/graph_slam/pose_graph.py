"""A graph of planar poses and what was measured between them, solved by sparse least squares.

Gauss-Newton on the poses with the first one held (Grisetti et al., "A tutorial on graph-based
SLAM", ITS Magazine 2010); closures count less the less they fit (Agarwal et al., "Robust map
optimization using dynamic covariance scaling", ICRA 2013), so that a wrong one bends little.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.linalg import splu

from grouser.geometry import Array, between, between_jacobians, compose_jacobians, wrap


class PoseGraph:
    """n poses (3,), the first at zero, and edges: pose j as measured from pose i."""

    def __init__(self) -> None:
        self._poses = np.zeros((64, 3))
        self._n = 1
        self._ends: list[tuple[int, int]] = []
        self._measured: list[Array] = []
        self._information: list[Array] = []
        self._doubted: list[bool] = []
        self._solved = _Solved(None, 1)

    def __len__(self) -> int:
        return self._n

    @property
    def poses(self) -> Array:
        """(n, 3), to be read."""
        return self._poses[: self._n]

    @property
    def loops(self) -> int:
        """How many were closed."""
        return sum(self._doubted)

    @property
    def closures(self) -> list[tuple[int, int, Array]]:
        """The loops: pose j as measured from pose i, as i, j and (3,)."""
        edges = zip(self._ends, self._measured, self._doubted, strict=True)
        return [(i, j, measured.copy()) for (i, j), measured, doubted in edges if doubted]

    def append(self, pose: Array, measured: Array, covariance: Array) -> None:
        """A pose, and how it was measured from the last one."""
        if self._n == len(self._poses):
            self._poses = np.concatenate([self._poses, np.zeros_like(self._poses)])
        self._solved.go_on(self._poses[self._n - 1], measured, covariance)
        self._poses[self._n] = pose
        self._n += 1
        information: Array = np.asarray(np.linalg.inv(covariance), dtype=np.float64)
        self._add(self._n - 2, self._n - 1, measured, information, doubted=False)

    def close(self, i: int, j: int, measured: Array, information: Array) -> None:
        """A loop: pose j as measured from pose i, (3,) with its information (3, 3)."""
        self._add(i, j, measured, information, doubted=True)

    def errors(self) -> Array:
        """(m,) squared error of each edge over its covariance; the edges in order."""
        _, e, _, _, W = self._linearised()
        return _squared(e, W)

    def optimise(self) -> None:
        """Move all poses but the first to where they fit the edges best."""
        if self._n == 1:
            return
        for _ in range(_STEPS):
            ends, e, by_i, by_j, W = self._weighed()
            solver = splu(_normal_matrix(ends, by_i, by_j, W, self._n), **_SYMMETRIC)
            b = np.zeros((self._n, 3))
            np.add.at(b, ends[:, 0], -np.einsum("mji,mjk,mk->mi", by_i, W, e))
            np.add.at(b, ends[:, 1], -np.einsum("mji,mjk,mk->mi", by_j, W, e))
            step = solver.solve(b[1:].ravel()).reshape(-1, 3)
            self._poses[1 : self._n] += step
            self._poses[1 : self._n, 2] = wrap(self._poses[1 : self._n, 2])
            if np.abs(step).max() < _STILL:
                break
        self._solved = _Solved(solver, self._n)

    @property
    def covariance(self) -> Array:
        """(3, 3) of the last pose. Loops that were closed since the last `optimise` do not count:
        they would only make it smaller."""
        return self._solved.covariance

    def relative_covariance(self, i: int) -> Array:
        """(3, 3) of the last pose as seen from pose i; the same holds of loops."""
        if i >= self._solved.n:
            ends, _, by_i, by_j, W = self._weighed()
            solver = splu(_normal_matrix(ends, by_i, by_j, W, self._n), **_SYMMETRIC)
            self._solved = _Solved(solver, self._n)
        by_i, by_last = between_jacobians(self._poses[i], self._poses[self._n - 1])
        cross = by_i @ self._solved.with_last(i) @ by_last.T
        P = by_i @ self._solved.marginal(i) @ by_i.T + by_last @ self.covariance @ by_last.T
        P = P + cross + cross.T
        return np.asarray((P + P.T) / 2)

    def _add(self, i: int, j: int, measured: Array, information: Array, *, doubted: bool) -> None:
        self._ends.append((i, j))
        self._measured.append(measured)
        self._information.append(information)
        self._doubted.append(doubted)

    def _linearised(self) -> tuple[NDArray[np.intp], Array, Array, Array, Array]:
        """Ends (m, 2), errors (m, 3), their derivatives (m, 3, 3) by both ends, information."""
        ends = np.array(self._ends, dtype=np.intp).reshape(-1, 2)
        a, b = self._poses[ends[:, 0]], self._poses[ends[:, 1]]
        e = between(a, b) - np.array(self._measured).reshape(-1, 3)
        e[:, 2] = wrap(e[:, 2])
        by_i, by_j = between_jacobians(a, b)
        return ends, e, by_i, by_j, np.array(self._information).reshape(-1, 3, 3)

    def _weighed(self) -> tuple[NDArray[np.intp], Array, Array, Array, Array]:
        """The same, with closures' information scaled by how well they fit."""
        ends, e, by_i, by_j, W = self._linearised()
        scale = np.minimum(1.0, 2 * _SCALING / (_SCALING + _squared(e, W)))
        weights = np.where(np.array(self._doubted), scale**2, 1.0)
        return ends, e, by_i, by_j, W * weights[:, None, None]


class _Solved:
    """Covariances of the n poses of a solved graph, and of the way on from the last of them."""

    def __init__(self, solver: Any, n: int) -> None:
        self._solver, self.n = solver, n
        self._with_last = self._column(n - 1)
        self._by_last, self._added = np.eye(3), np.zeros((3, 3))

    @property
    def covariance(self) -> Array:
        """(3, 3) of the pose that the way leads to."""
        P = self._by_last @ self._with_last[-1] @ self._by_last.T + self._added
        return np.asarray((P + P.T) / 2)

    def with_last(self, i: int) -> Array:
        """(3, 3) covariance of pose i with it."""
        return np.asarray(self._with_last[i] @ self._by_last.T)

    def marginal(self, i: int) -> Array:
        """(3, 3) of pose i."""
        return np.asarray(self._column(i)[i])

    def go_on(self, pose: Array, increment: Array, covariance: Array) -> None:
        """A step from the last pose, which is at `pose`."""
        by_pose, by_increment = compose_jacobians(pose, increment)
        self._by_last = by_pose @ self._by_last
        self._added = by_pose @ self._added @ by_pose.T
        self._added += by_increment @ covariance @ by_increment.T

    def _column(self, k: int) -> Array:
        """(n, 3, 3) covariance of each pose with pose k."""
        found = np.zeros((self.n, 3, 3))
        if k > 0:
            unit = np.zeros((3 * self.n - 3, 3))
            unit[3 * k - 3 : 3 * k] = np.eye(3)
            found[1:] = self._solver.solve(unit).reshape(-1, 3, 3)
        return found


_STEPS = 8
_STILL = 1e-5
"""m, rad: a step that changes nothing any more"""
_SCALING = 16.0
"""Squared error over its covariance from which on a closure counts less"""
_SYMMETRIC: dict[str, Any] = {
    "permc_spec": "MMD_AT_PLUS_A",
    "diag_pivot_thresh": 0.0,
    "options": {"SymmetricMode": True},
}


def _squared(e: Array, W: Array) -> Array:
    return np.asarray(np.einsum("mi,mij,mj->m", e, W, e))


def _normal_matrix(ends: NDArray[np.intp], by_i: Array, by_j: Array, W: Array, n: int) -> Any:
    """J^T W J, sparse, without the first pose's rows and columns."""
    transposed_i, transposed_j = np.swapaxes(by_i, 1, 2), np.swapaxes(by_j, 1, 2)
    blocks = np.concatenate(
        [
            transposed_i @ W @ by_i,
            transposed_i @ W @ by_j,
            transposed_j @ W @ by_i,
            transposed_j @ W @ by_j,
        ]
    )
    i, j = ends[:, 0], ends[:, 1]
    rows, columns = np.concatenate([i, i, j, j]), np.concatenate([i, j, i, j])
    kept = (rows > 0) & (columns > 0)
    blocks, at = blocks[kept], np.arange(3)
    r = np.broadcast_to(3 * (rows[kept] - 1)[:, None, None] + at[:, None], blocks.shape)
    c = np.broadcast_to(3 * (columns[kept] - 1)[:, None, None] + at, blocks.shape)
    size = 3 * (n - 1)
    entries = (blocks.ravel(), (r.ravel(), c.ravel()))
    return sparse.coo_matrix(entries, shape=(size, size)).tocsc()
