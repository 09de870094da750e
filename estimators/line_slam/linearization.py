"""Where the filter's Jacobians are evaluated, and in which error its corrections are linear.

A line's place in the robot's frame, h = (r - x cos a - y sin a, a - heading) (SPEC 2.2), has the
derivative by (x, y, heading, r, a)

    [ -cos a0  -sin a0   g   1   c ]
    [    0        0     -1   0   1 ]

whose four numbers (cos a0, sin a0, g, c) say where: with a0 = a, c = x sin a - y cos a and g = 0 it
is that of the estimate. No change of all lines and the pose together can be seen (three
directions, a shift and a turn), but where Jacobians are taken at different estimates of the same
thing a filter takes itself to have seen one, and becomes too sure (Huang and Dissanayake 2007).
"""

import math
from abc import ABC, abstractmethod

import numpy as np

from grouser.checks import did_you_mean
from grouser.estimators.line_slam.lines import normals
from grouser.estimators.line_slam.motion import Step
from grouser.estimators.line_slam.sparse_update import shear
from grouser.estimators.line_slam.state import POSE, LineState
from grouser.estimators.visual.single_pose import wrapped
from grouser.geometry import Array, rotate, wrap
from grouser.kernels import kernel, kernel_using

_ALL = slice(None)


class Linearization(ABC):
    """How the filter linearises; it is told of everything that happens to the state."""

    @abstractmethod
    def step(self, state: LineState, step: Step) -> Array:
        """(3, 3) derivative of the pose after a step by the pose before it; the state is yet
        before it."""

    @abstractmethod
    def begin(self, state: LineState) -> None:
        """Corrections of one scan follow, on this state."""

    @abstractmethod
    def jacobians(self, state: LineState, lines: slice = _ALL) -> Array:
        """(n, 4) cos a0, sin a0, g, c of every line, or of some."""

    @abstractmethod
    def correct(self, state: LineState, change: Array) -> None:
        """Correct the mean by what the filter found (n,)."""

    @abstractmethod
    def end(self, state: LineState) -> None:
        """The corrections are done, and taken off the covariance."""

    @abstractmethod
    def added(self, state: LineState) -> None:
        """The state has a new last line."""

    @abstractmethod
    def forgot(self, line: int) -> None:
        """The state no longer has that line."""


class AtTheEstimate(Linearization):
    """The standard EKF: every Jacobian at the latest estimate."""

    def step(self, state: LineState, step: Step) -> Array:
        return step.by_pose

    def begin(self, state: LineState) -> None:
        """Nothing is fixed."""

    def jacobians(self, state: LineState, lines: slice = _ALL) -> Array:
        return np.asarray(at(state.lines[lines, 1], state.pose))

    def correct(self, state: LineState, change: Array) -> None:
        add(state, change)

    def end(self, state: LineState) -> None:
        """The covariance is of the very errors that the mean was corrected by."""

    def added(self, state: LineState) -> None:
        """Nothing is remembered of it."""

    def forgot(self, line: int) -> None:
        """Nothing was remembered of it."""


class FirstEstimates(Linearization):
    """First-estimates Jacobians (Huang, Mourikis and Roumeliotis 2010): a line at its first
    estimate, a pose at its prediction, so that what nobody can see stays unseen."""

    def __init__(self) -> None:
        self._alpha = np.zeros(0)
        self._predicted: Array | None = None

    def step(self, state: LineState, step: Step) -> Array:
        before = state.pose[:2] if self._predicted is None else self._predicted
        F = step.by_pose.copy()
        F[:2, 2] = rotate(np.pi / 2, step.pose[:2] - before)
        self._predicted = step.pose[:2].copy()
        return F

    def begin(self, state: LineState) -> None:
        self._pose = state.pose.copy()

    def jacobians(self, state: LineState, lines: slice = _ALL) -> Array:
        return np.asarray(at(self._alpha[lines], self._pose))

    def correct(self, state: LineState, change: Array) -> None:
        add(state, change)

    def end(self, state: LineState) -> None:
        """The covariance is of the very errors that the mean was corrected by."""

    def added(self, state: LineState) -> None:
        self._alpha = np.append(self._alpha, state.lines[-1, 1])

    def forgot(self, line: int) -> None:
        self._alpha = np.delete(self._alpha, line)


class RightInvariant(Linearization):
    """The right-invariant EKF: errors are a motion of the whole plane, and of lines in it.

    With T the pose and (r, a) a line, the truth is the estimate after a motion exp(xi) of the
    plane, which takes the pose and every line along, and after own changes (e_r, e_a) of each line:

        T = exp(xi) T^,   l = exp(xi) . (l^ + e).

    A line as the robot sees it, T^-1 . l = T^^-1 . (l^ + e), depends on e alone, whatever the
    estimate, so that xi, which nobody can see, stays unseen: its covariance falls only through
    what correlates it with e. A motion in the robot's frame leaves xi as it is, but for its noise.

    The covariance is kept of the usual errors, which at an estimate are J(estimate) times these; so
    when a scan has moved the estimate, it is carried over from the old J to the new one.
    """

    def step(self, state: LineState, step: Step) -> Array:
        # J at the new pose times J^-1 at the old one, for either is an estimate: by_pose itself.
        return step.by_pose

    def begin(self, state: LineState) -> None:
        self._pose, self._alpha = state.pose.copy(), state.lines[:, 1].copy()

    def jacobians(self, state: LineState, lines: slice = _ALL) -> Array:
        # Of e at the latest estimate, [1 c; 0 1], times J^-1 at the one where the scan began.
        rows: Array = at(self._alpha[lines], self._pose)
        c = at(state.lines[lines, 1], state.pose)[:, 3]
        rows[:, 2] = rows[:, 3] - c
        rows[:, 3] = c
        return rows

    def correct(self, state: LineState, change: Array) -> None:
        turn, shift = change[2], change[:2] - change[2] * rotate(np.pi / 2, self._pose[:2])
        lines = change[state.head :].reshape(-1, 2)
        own = np.stack([lines[:, 0] - normals(self._alpha) @ shift, lines[:, 1] - turn], axis=-1)
        shift = _along(turn) @ shift
        state.pose[:2] = rotate(turn, state.pose[:2]) + shift
        state.pose[2] = wrap(state.pose[2] + turn)
        state.errors[:] += change[POSE : state.head]
        state.lines[:] += own
        state.lines[:, 1] = wrap(state.lines[:, 1] + turn)
        state.lines[:, 0] += normals(state.lines[:, 1]) @ shift

    def end(self, state: LineState) -> None:
        U = np.zeros((state.size, POSE))
        U[:2, 2] = rotate(np.pi / 2, state.pose[:2] - self._pose[:2])
        turned = normals(state.lines[:, 1]) - normals(self._alpha)
        U[state.head :: 2, :2] = turned
        U[state.head :: 2, 2] = -turned @ rotate(np.pi / 2, self._pose[:2])
        shear(state.buffer, state.size, POSE, U)

    def added(self, state: LineState) -> None:
        """Its error is correlated with the pose's as the usual one is: J is taken when it moves."""

    def forgot(self, line: int) -> None:
        """Nothing is kept of it beyond a scan."""


@kernel
def at(alpha: Array, pose: Array) -> Array:
    """(n, 4) the derivative's numbers where lines have directions (n,) and the pose is (3,)."""
    out = np.zeros((len(alpha), 4))
    for i in range(len(alpha)):
        c, s = math.cos(alpha[i]), math.sin(alpha[i])
        out[i, 0], out[i, 1], out[i, 3] = c, s, pose[0] * s - pose[1] * c
    return out


def jacobian(row: Array) -> Array:
    """(2, 5) of one line's four numbers."""
    return np.array([[-row[0], -row[1], row[2], 1.0, row[3]], [0.0, 0.0, -1.0, 0.0, 1.0]])


def add(state: LineState, change: Array) -> None:
    """Correct the mean by adding, and wrap its angles."""
    _add(state.mean, state.head, change)


@kernel_using(wrapped)
def _add(mean: Array, head: int, change: Array) -> None:
    for i in range(len(change)):
        mean[i] += change[i]
    mean[2] = wrapped(mean[2])
    for i in range(head + 1, len(change), 2):
        mean[i] = wrapped(mean[i])


LINEARIZATIONS: dict[str, type[Linearization]] = {
    "standard": AtTheEstimate,
    "first-estimates": FirstEstimates,
    "right-invariant": RightInvariant,
}


def make_linearization(name: str) -> Linearization:
    """A new one by its name.

    Raises:
        ValueError: there is none of that name.
    """
    if name not in LINEARIZATIONS:
        hint = did_you_mean(name, LINEARIZATIONS)
        raise ValueError(
            f"jacobians must be one of {', '.join(map(repr, LINEARIZATIONS))}, got {name!r}; {hint}"
        )
    return LINEARIZATIONS[name]()


def _along(turn: float) -> Array:
    """(2, 2) the shift of exp of a twist, by its first two numbers: V(turn) of SE(2)."""
    a, b = np.sinc(turn / np.pi), np.sin(turn / 2) * np.sinc(turn / 2 / np.pi)
    return np.array([[a, -b], [b, a]])
