"""The filter's state: pose, constant errors of the motion, lines; and their joint covariance."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from grouser.estimators.line_slam.sparse_update import augment, block, remove
from grouser.geometry import Array

POSE = 3


class LineState:
    """X = (x, y, heading, errors, r_1, alpha_1, r_2, alpha_2, ...) in the frame of the start.

    r [m] may be negative, angles are wrapped. The pose may be moved by whoever holds the state.
    """

    def __init__(self, pose: Array, error_sigmas: Array) -> None:
        """pose: (3,), known exactly; error_sigmas: (n,) of the constant errors, which are zero."""
        self.head = POSE + len(error_sigmas)
        """States before the lines."""
        self.size = self.head
        capacity = self.head + 2 * _FIRST_LINES
        self.mean = np.zeros(capacity)
        self.mean[:POSE] = pose
        self.buffer = np.zeros((capacity, capacity))
        """Covariance; of `size` states, the upper triangle: see `sparse_update.py`."""
        self.buffer[: self.head, : self.head] = np.diag(np.append(np.zeros(3), error_sigmas**2))

    def __len__(self) -> int:
        """How many lines."""
        return (self.size - self.head) // 2

    @property
    def pose(self) -> Array:
        """(3,) a view."""
        return self.mean[:POSE]

    @property
    def errors(self) -> Array:
        """(n,) the constant errors, a view."""
        return self.mean[POSE : self.head]

    @property
    def lines(self) -> Array:
        """(n, 2) a view."""
        return self.mean[self.head : self.size].reshape(-1, 2)

    def covariance(self, indices: "NDArray[np.intp] | Sequence[int]") -> Array:
        """(k, k) of the states at `indices`."""
        return np.asarray(block(self.buffer, np.asarray(indices, dtype=np.intp)))

    @property
    def pose_covariance(self) -> Array:
        """(3, 3)"""
        return self.covariance(range(POSE))

    def states_of(self, line: int) -> list[int]:
        """Indices of a line's r and alpha."""
        return [self.head + 2 * line, self.head + 2 * line + 1]

    def line_covariances(self) -> Array:
        """(n, 2, 2) of each line by itself."""
        out = np.empty((len(self), 2, 2))
        r = np.arange(self.head, self.size, 2)
        out[:, 0, 0], out[:, 1, 1] = self.buffer[r, r], self.buffer[r + 1, r + 1]
        out[:, 0, 1] = out[:, 1, 0] = self.buffer[r, r + 1]
        return out

    def add(self, line: Array, indices: Sequence[int], G: Array, noise: Array) -> int:
        """A line (2,) more, with derivative G (2, k) by the states at `indices`, and a noise
        (2, 2); its number."""
        if self.size + 2 > len(self.mean):
            self._grow()
        augment(self.buffer, self.size, np.asarray(indices, dtype=np.intp), G, noise)
        self.mean[self.size : self.size + 2] = line
        self.size += 2
        return len(self) - 1

    def forget(self, line: int) -> None:
        """The lines behind it move up."""
        at = self.states_of(line)[0]
        remove(self.buffer, self.size, at)
        self.mean[at : self.size - 2] = self.mean[at + 2 : self.size].copy()
        self.size -= 2

    def _grow(self) -> None:
        capacity = 2 * len(self.mean)
        mean, buffer = np.zeros(capacity), np.zeros((capacity, capacity))
        mean[: self.size] = self.mean[: self.size]
        buffer[: self.size, : self.size] = self.buffer[: self.size, : self.size]
        self.mean, self.buffer = mean, buffer


_FIRST_LINES = 16
