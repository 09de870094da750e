"""Newton's and Euler's laws on the rigid body of our own."""

import numpy as np
import pytest

from grouser.envs.simulation.fast_body import move
from grouser.envs.simulation.track_law import rotation_of
from grouser.geometry import Array, rotation_from_rpy, so3_exp

MASS, INERTIA, DT = 3.0, np.array([0.8, 1.3, 1.9]), 1 / 240


def body(velocity: tuple[float, float, float], rate: tuple[float, float, float]) -> Array:
    state = np.zeros(13)
    state[6] = 1.0
    state[7:10], state[10:13] = velocity, rate
    return state


def moved(state: Array, wrench: Array, n: int) -> Array:
    R = np.empty((3, 3))
    for _ in range(n):
        rotation_of(state, R)
        move(state, R, wrench, MASS, INERTIA, DT)
    return state


def momentum(state: Array) -> Array:
    """Angular momentum in the world frame."""
    R = np.empty((3, 3))
    rotation_of(state, R)
    return np.asarray(R @ (INERTIA * (R.T @ state[10:13])))


def test_a_force_accelerates_and_gravity_pulls() -> None:
    state = moved(body((1.0, 0, 0), (0, 0, 0)), np.array([6.0, 0, 0, 0, 0, 0]), 240)
    np.testing.assert_allclose(state[7:10], [3.0, 0, -9.81], rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(state[:3], [2.0, 0, -9.81 / 2], rtol=0.01)


@pytest.mark.parametrize("axis", range(3))
def test_a_torque_turns_about_each_axis_by_its_inertia(axis: int) -> None:
    wrench = np.zeros(6)
    wrench[3 + axis] = 0.5
    state = moved(body((0, 0, 0), (0, 0, 0)), wrench, 240)
    expected = np.zeros(3)
    expected[axis] = 0.5 / INERTIA[axis]
    np.testing.assert_allclose(state[10:13], expected, rtol=1e-9, atol=1e-12)


def test_a_steady_turn_is_exact() -> None:
    R = np.empty((3, 3))
    rotation_of(moved(body((0, 0, 0), (0, 0, 2.0)), np.zeros(6), 240), R)
    np.testing.assert_allclose(R, rotation_from_rpy(0, 0, 2.0), atol=1e-10)
    np.testing.assert_allclose(R, so3_exp([0, 0, 2.0]), atol=1e-10)


def test_a_tumbling_body_keeps_its_angular_momentum_and_energy() -> None:
    """Within the first-order error of the step: a percent over two seconds of wild tumbling."""
    state = body((0, 0, 0), (1.5, 2.0, 0.3))
    before, energy = momentum(state), 0.5 * INERTIA @ state[10:13] ** 2
    moved(state, np.zeros(6), 480)
    np.testing.assert_allclose(momentum(state), before, atol=0.02 * float(np.linalg.norm(before)))
    R = np.empty((3, 3))
    rotation_of(state, R)
    assert 0.5 * INERTIA @ (R.T @ state[10:13]) ** 2 == pytest.approx(energy, rel=0.02)
    assert np.linalg.norm(state[3:7]) == pytest.approx(1.0, abs=1e-12)
