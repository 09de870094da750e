"""What nobody can see stays unseen, by each choice of Jacobians; and they are right."""

import numpy as np
import pytest

from grouser.estimators.line_slam.linearization import (
    AtTheEstimate,
    FirstEstimates,
    Linearization,
    RightInvariant,
    jacobian,
    make_linearization,
)
from grouser.estimators.line_slam.lines import lines_in_frame, lines_to_world
from grouser.estimators.line_slam.motion import Step
from grouser.estimators.line_slam.sparse_update import absorb, correct, propagate
from grouser.estimators.line_slam.state import LineState
from grouser.geometry import Array, compose, compose_jacobians, rotate

LINES = np.array([[3.0, 0.4], [-2.0, 2.0], [5.0, -2.5]])
POSE = np.array([1.5, -0.7, 0.6])


def state_of(linearization: Linearization) -> LineState:
    state = LineState(POSE, np.zeros(0))
    state.buffer[:3, :3] = np.diag([0.02, 0.03, 0.01])
    for line in LINES:
        lever = -POSE[0] * np.sin(line[1]) + POSE[1] * np.cos(line[1])
        G = np.array([[np.cos(line[1]), np.sin(line[1]), lever], [0, 0, 1]])
        state.add(line, range(3), G, np.diag([0.05, 0.004]))
        linearization.added(state)
    return state


def moved(state: LineState, change: Array) -> LineState:
    """The plane, with pose and lines, shifted and turned: nobody can see that."""
    other = LineState(compose(change, state.pose), np.zeros(0))
    for line in lines_to_world(state.lines, change):
        other.add(line, (), np.zeros((2, 0)), np.zeros((2, 2)))
    return other


@pytest.mark.parametrize("kind", [AtTheEstimate, FirstEstimates, RightInvariant])
def test_the_jacobian_is_that_of_finite_differences(kind: type[Linearization]) -> None:
    linearization = kind()
    state = state_of(linearization)
    linearization.begin(state)
    for line, row in enumerate(linearization.jacobians(state)):
        at = np.concatenate([state.pose, state.lines[line]])
        sides = []
        for d in np.eye(5) * 1e-6:
            up, down = at + d, at - d
            sides.append(
                (lines_in_frame(up[3:], up[:3]) - lines_in_frame(down[3:], down[:3])) / 2e-6
            )
        np.testing.assert_allclose(jacobian(row), np.stack(sides, axis=-1), atol=1e-6)


def unseen(state: LineState) -> Array:
    """(n, 3) the directions of `moved` at a state, by finite differences."""
    columns = []
    for d in np.eye(3) * 1e-6:
        up, down = moved(state, d).mean[: state.size], moved(state, -d).mean[: state.size]
        columns.append((up - down) / 2e-6)
    return np.stack(columns, axis=-1)


def information_on(kind: type[Linearization], *, surprise: float) -> float:
    """What a filter learns of the unseen: pose and lines are shifted and turned together without
    anybody knowing how far (variance 1), then seen again and again with surprises between steps.

    The least eigenvalue of the covariance that is left of it; 1 where nothing was learned.
    """
    linearization = kind()
    state = state_of(linearization)
    N = unseen(state)
    n = state.size
    rows, columns = np.triu_indices(n)
    state.buffer[rows, columns] += (N @ N.T)[rows, columns]
    rng = np.random.default_rng(0)
    for _ in range(12):
        increment = np.array([0.8, 0.1, 0.2])
        by_pose, _ = compose_jacobians(state.pose, increment)
        step = Step(compose(state.pose, increment), by_pose, np.zeros((3, 0)), np.zeros((3, 3)))
        propagate(state.buffer, n, linearization.step(state, step), 1e-4 * np.eye(3))
        state.pose[:] = step.pose
        linearization.begin(state)
        W = np.zeros((6, len(state.mean)))
        for line in range(3):
            row = linearization.jacobians(state)[line]
            indices = np.array([0, 1, 2, *state.states_of(line)])
            residual = rng.normal(size=2) * surprise
            R = np.diag([1e-3, 1e-3])
            change, _ = correct(
                state.buffer, n, W, 2 * line, indices, jacobian(row), R, residual, np.inf
            )
            linearization.correct(state, change)
        absorb(state.buffer, n, W, 6)
        linearization.end(state)
    # Of the errors, the part that is a motion of the whole plane, in its own coordinates.
    information = np.linalg.inv(state.covariance(range(n)))
    N = unseen(state)
    return float(np.linalg.eigvalsh(N.T @ information @ N).max())


def test_surprises_teach_the_standard_filter_what_cannot_be_known() -> None:
    standard = information_on(AtTheEstimate, surprise=0.15)
    invariant = information_on(RightInvariant, surprise=0.15)
    # The prior alone has information 1 / (1 + its own), which is less than 1, in each direction;
    # process noise on the pose only takes from it.
    assert invariant <= 1.0 + 1e-6
    assert standard > 2 * invariant


def test_without_surprises_no_filter_learns_the_unseen() -> None:
    for kind in (AtTheEstimate, FirstEstimates, RightInvariant):
        assert information_on(kind, surprise=0.0) <= 1.0 + 1e-6


def test_first_estimates_keep_one_unseen_space() -> None:
    """Its Jacobians multiply to what has three directions in its null space, though estimates
    move in between; those of the standard filter do not."""
    spans = {}
    for kind in (AtTheEstimate, FirstEstimates):
        linearization, rng = kind(), np.random.default_rng(1)
        state = state_of(linearization)
        Phi, seen_of_start = np.eye(state.size), []
        for _ in range(6):
            increment = np.array([0.8, 0.1, 0.2])
            by_pose, _ = compose_jacobians(state.pose, increment)
            step = Step(compose(state.pose, increment), by_pose, np.zeros((3, 0)), np.zeros((3, 3)))
            F = np.eye(state.size)
            F[:3, :3] = linearization.step(state, step)
            state.pose[:] = step.pose
            Phi = F @ Phi
            linearization.begin(state)
            for line, row in enumerate(linearization.jacobians(state)):
                H = np.zeros((2, state.size))
                H[:, [0, 1, 2, *state.states_of(line)]] = jacobian(row)
                seen_of_start.append(H @ Phi)
            linearization.correct(state, 0.05 * rng.normal(size=state.size))
            linearization.end(state)
        spans[kind] = np.linalg.svd(np.vstack(seen_of_start), compute_uv=False)
    assert spans[FirstEstimates][-3:].max() < 1e-9
    assert spans[AtTheEstimate][-2] > 1e-3


def test_right_invariant_corrections_move_the_whole_plane_exactly() -> None:
    """A change along the unseen directions moves pose and lines together: what the robot sees of
    them stays the same, however far."""
    linearization = RightInvariant()
    state = state_of(linearization)
    before = lines_in_frame(state.lines, state.pose)
    linearization.begin(state)
    linearization.correct(state, unseen(state) @ np.array([0.8, -0.5, 0.9]))
    np.testing.assert_allclose(lines_in_frame(state.lines, state.pose), before, atol=1e-6)
    assert abs(state.pose[2] - POSE[2]) == pytest.approx(0.9, abs=1e-6)


def test_right_invariant_covariance_is_carried_along() -> None:
    """The covariance of a plane that is not known to a shift and a turn is that after it moved."""
    linearization = RightInvariant()
    state = state_of(linearization)
    n = state.size
    rows, columns = np.triu_indices(n)
    N = unseen(state)
    state.buffer[rows, columns] = (N @ N.T)[rows, columns]
    linearization.begin(state)
    linearization.correct(state, np.random.default_rng(2).normal(size=n) * 0.2)
    linearization.end(state)
    N = unseen(state)
    np.testing.assert_allclose(state.covariance(range(n)), N @ N.T, atol=1e-6)


def test_an_unknown_choice_is_refused() -> None:
    with pytest.raises(ValueError, match="jacobians must be one of 'standard', .* did you mean"):
        make_linearization("standart")


def test_shift_of_exp() -> None:
    from grouser.estimators.line_slam.linearization import _along
    from grouser.geometry import exp

    twist = np.array([0.7, -0.4, 1.1])
    np.testing.assert_allclose(_along(1.1) @ twist[:2], exp(twist)[:2], atol=1e-14)
    np.testing.assert_allclose(rotate(0.0, _along(0.0) @ twist[:2]), twist[:2])
