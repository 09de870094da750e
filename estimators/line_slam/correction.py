"""The filter's corrections: of pose and map by lines that were seen, of two lines that are one."""

import numpy as np

from grouser.estimators.line_slam.association import Pairs
from grouser.estimators.line_slam.gating import expected, innovation, jacobian
from grouser.estimators.line_slam.linearization import Linearization
from grouser.estimators.line_slam.measurements import LineMeasurements
from grouser.estimators.line_slam.merging import EXACT, Twins
from grouser.estimators.line_slam.sparse_update import absorb, correct
from grouser.estimators.line_slam.state import LineState
from grouser.geometry import Array
from grouser.kernels import kernel_using


class Corrector:
    """Corrects a state, and takes what the corrections of one scan tell off its covariance at once,
    for each such pass goes over all of it."""

    def __init__(self, linearization: Linearization, *, gate: float, two_sided: bool) -> None:
        """
        Args:
            gate: d2 up to which a line that was seen is one of the map;
            two_sided: whether the sides of a line are different ones: as in `AssociationOptions`.
        """
        self._linearization, self._gate, self._two_sided = linearization, gate, two_sided
        self._W = np.zeros((2 * _LINES_AT_ONCE, 0))

    def by_lines(
        self, state: LineState, seen: LineMeasurements, pairs: Pairs
    ) -> tuple[list[int], list[float]]:
        """By one line after another: which of the pairs still fit after those before them, and
        their d2."""
        W, used = self._room(state), 0
        believed: list[int] = []
        d2: list[float] = []
        self._linearization.begin(state)
        for k, (i, line) in enumerate(zip(pairs.seen.tolist(), pairs.lines.tolist(), strict=True)):
            change, fit = _by_line(
                state.buffer,
                state.mean,
                state.size,
                state.head,
                W,
                used,
                line,
                self._linearization.jacobians(state, slice(line, line + 1)),
                seen.lines[i],
                seen.covariances[i],
                self._gate,
                self._two_sided,
            )
            if not fit <= self._gate:
                continue
            self._linearization.correct(state, change)
            believed.append(k)
            d2.append(fit)
            used += 2
            if used == len(W):
                absorb(state.buffer, state.size, W, used)
                used = 0
        absorb(state.buffer, state.size, W, used)
        self._linearization.end(state)
        return believed, d2

    def by_twins(self, state: LineState, twins: Twins) -> None:
        """By a difference that is known to be zero."""
        W = self._room(state)
        self._linearization.begin(state)
        indices = np.array(twins.indices, dtype=np.intp)
        change, _ = correct(
            state.buffer, state.size, W, 0, indices, twins.H, EXACT, -twins.difference, np.inf
        )
        self._linearization.correct(state, change)
        absorb(state.buffer, state.size, W, 2)
        self._linearization.end(state)

    def _room(self, state: LineState) -> Array:
        """W of `sparse_update.py`, for as many states as there may be."""
        if self._W.shape[1] < len(state.mean):
            self._W = np.zeros((len(self._W), len(state.mean)))
        return self._W


@kernel_using(expected, innovation, jacobian, correct)
def _by_line(
    P: Array,
    mean: Array,
    n: int,
    head: int,
    W: Array,
    used: int,
    line: int,
    rows: Array,
    z: Array,
    R: Array,
    gate: float,
    two_sided: bool,
) -> tuple[Array, float]:
    """`correct` by a line (2,), turned over where the map has it written the other way about.

    Args:
        rows: (1, 4) of its Jacobian, see `linearization.py`.
    """
    at = head + 2 * line
    r, alpha = expected(mean, at)
    off_r, off_alpha, turned = innovation(r, alpha, z, two_sided)
    nu, noise = np.array([off_r, off_alpha]), R.copy()
    if turned:
        noise[0, 1], noise[1, 0] = -noise[0, 1], -noise[1, 0]
    H, indices = np.zeros((2, 5)), np.array([0, 1, 2, 0, 0])
    jacobian(rows[0], at, H, indices)
    change, d2 = correct(P, n, W, used, indices, H, noise, nu, gate)
    return change, d2


_LINES_AT_ONCE = 64
