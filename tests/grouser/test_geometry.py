"""SE(2) and SE(3) as groups: axioms, maps that undo each other, Jacobians, batches."""

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from grouser import geometry
from grouser.geometry import Array

# Ordinary headings, the seam at half a turn from both sides, and the neighbourhood of identity.
headings = st.one_of(
    st.floats(-np.pi, np.pi, exclude_min=True),
    st.sampled_from([np.pi, np.nextafter(np.pi, 0), np.nextafter(-np.pi, 0), -3.1415926, 0.0]),
    st.floats(-1e-7, 1e-7),
)
lengths = st.one_of(st.floats(-50.0, 50.0), st.floats(-1e-7, 1e-7))
poses = st.builds(lambda x, y, heading: np.array([x, y, heading]), lengths, lengths, headings)
small_vectors = st.builds(lambda *v: np.array(v), *[st.floats(-1e-7, 1e-7)] * 3)
vectors = st.one_of(small_vectors, st.builds(lambda *v: np.array(v), *[st.floats(-2.0, 2.0)] * 3))

TOLERANCE = 1e-12


def difference(a: Array, b: Array) -> float:
    """Largest entry of a - b, headings compared on the circle."""
    return float(np.abs(np.append(a[:2] - b[:2], geometry.wrap(a[2] - b[2]))).max())


def numeric_jacobian(f: Callable[[Array], Array], at: Array, step: float = 1e-6) -> Array:
    columns = []
    for axis in np.eye(len(at)) * step:
        change = f(at + axis) - f(at - axis)
        change[2] = geometry.wrap(change[2])
        columns.append(change / (2 * step))
    return np.stack(columns, axis=-1)


@given(st.floats(-1e4, 1e4))
def test_wrap_stays_on_the_circle_and_inside_its_range(angle: float) -> None:
    wrapped = float(geometry.wrap(angle))
    assert -np.pi < wrapped <= np.pi
    assert abs(np.exp(1j * wrapped) - np.exp(1j * angle)) < 1e-11
    assert geometry.wrap(wrapped) == wrapped


def test_wrap_sends_half_a_turn_to_plus_pi_from_both_sides() -> None:
    seam = [np.pi, -np.pi, 3 * np.pi, np.nextafter(np.pi, 4), np.nextafter(-np.pi, -4)]
    wrapped = geometry.wrap(seam)
    assert np.array_equal(wrapped[:2], [np.pi, np.pi])
    assert np.abs(np.abs(wrapped) - np.pi).max() < 1e-15
    assert (wrapped > -np.pi).all()


@given(poses, poses, poses)
def test_composition_is_associative(a: Array, b: Array, c: Array) -> None:
    left = geometry.compose(geometry.compose(a, b), c)
    assert difference(left, geometry.compose(a, geometry.compose(b, c))) < TOLERANCE


@given(poses)
def test_identity_and_inverse(a: Array) -> None:
    identity = np.zeros(3)
    assert difference(geometry.compose(a, identity), a) < TOLERANCE
    assert difference(geometry.compose(identity, a), a) < TOLERANCE
    assert difference(geometry.compose(a, geometry.inverse(a)), identity) < TOLERANCE
    assert difference(geometry.compose(geometry.inverse(a), a), identity) < TOLERANCE
    assert difference(geometry.inverse(geometry.inverse(a)), a) < TOLERANCE


@given(poses, poses)
def test_between_undoes_compose(a: Array, b: Array) -> None:
    assert difference(geometry.compose(a, geometry.between(a, b)), b) < TOLERANCE
    assert difference(geometry.between(a, geometry.compose(a, b)), b) < TOLERANCE
    by_inverse = geometry.compose(geometry.inverse(a), b)
    assert difference(geometry.between(a, b), by_inverse) < TOLERANCE


@given(poses, poses)
def test_every_heading_comes_out_wrapped(a: Array, b: Array) -> None:
    results = [
        geometry.compose(a, b),
        geometry.between(a, b),
        geometry.inverse(a),
        geometry.exp(a),
        geometry.project(geometry.lift(a)),
    ]
    assert all(-np.pi < pose[2] <= np.pi for pose in results)


@given(poses)
def test_exp_undoes_log(pose: Array) -> None:
    assert difference(geometry.exp(geometry.log(pose)), pose) < 1e-11


@given(poses)
def test_log_undoes_exp(twist: Array) -> None:
    assert np.abs(geometry.log(geometry.exp(twist)) - twist).max() < 1e-10


@given(small_vectors)
def test_log_undoes_exp_to_relative_precision_near_identity(twist: Array) -> None:
    assert np.abs(geometry.log(geometry.exp(twist)) - twist).max() < 1e-20


@given(poses)
def test_half_a_twist_twice_is_the_twist(twist: Array) -> None:
    half = geometry.exp(twist / 2)
    assert difference(geometry.compose(half, half), geometry.exp(twist)) < TOLERANCE


@given(poses, poses)
def test_compose_jacobians_match_finite_differences(a: Array, b: Array) -> None:
    a[:2], b[:2] = a[:2] / 10, b[:2] / 10  # so that differencing itself is good to 1e-6
    wrt_a, wrt_b = geometry.compose_jacobians(a, b)
    assert np.abs(wrt_a - numeric_jacobian(lambda x: geometry.compose(x, b), a)).max() < 1e-6
    assert np.abs(wrt_b - numeric_jacobian(lambda x: geometry.compose(a, x), b)).max() < 1e-6


@given(poses, poses)
def test_between_jacobians_match_finite_differences(a: Array, b: Array) -> None:
    a[:2], b[:2] = a[:2] / 10, b[:2] / 10
    wrt_a, wrt_b = geometry.between_jacobians(a, b)
    assert np.abs(wrt_a - numeric_jacobian(lambda x: geometry.between(x, b), a)).max() < 1e-6
    assert np.abs(wrt_b - numeric_jacobian(lambda x: geometry.between(a, x), b)).max() < 1e-6


@given(poses, poses)
def test_lift_is_a_homomorphism_and_project_undoes_it(a: Array, b: Array) -> None:
    product = geometry.lift(a) @ geometry.lift(b)
    assert np.abs(geometry.lift(geometry.compose(a, b)) - product).max() < TOLERANCE
    assert difference(geometry.project(geometry.lift(a)), a) < TOLERANCE


@given(vectors, vectors)
def test_inverse_transform_undoes_a_transform(rotation_vector: Array, translation: Array) -> None:
    T = geometry.transform(geometry.so3_exp(rotation_vector), translation)
    assert np.abs(T @ geometry.inverse_transform(T) - np.eye(4)).max() < TOLERANCE


@given(vectors, vectors)
def test_skew_is_the_cross_product(v: Array, w: Array) -> None:
    assert np.abs(geometry.skew(v) @ w - np.cross(v, w)).max() < TOLERANCE


@given(vectors)
def test_so3_exp_is_a_rotation_that_keeps_its_axis(v: Array) -> None:
    R = geometry.so3_exp(v)
    assert np.abs(R @ R.T - np.eye(3)).max() < TOLERANCE
    assert np.linalg.det(R) == pytest.approx(1.0, abs=TOLERANCE)
    assert np.abs(R @ v - v).max() < TOLERANCE
    assert np.trace(R) == pytest.approx(1 + 2 * np.cos(np.linalg.norm(v)), abs=TOLERANCE)


def test_so3_exp_agrees_with_roll_pitch_and_yaw_about_each_axis() -> None:
    angle = 0.3
    for axis, rpy in zip(np.eye(3), np.eye(3) * angle, strict=True):
        expected = geometry.rotation_from_rpy(*rpy)
        assert np.abs(geometry.so3_exp(axis * angle) - expected).max() < 1e-15


def test_positive_pitch_lowers_the_nose_and_positive_yaw_turns_left() -> None:
    assert geometry.rotation_from_rpy(0.0, 0.1, 0.0)[2, 0] < 0
    assert geometry.rotation_from_rpy(0.0, 0.0, 0.1)[1, 0] > 0
    assert geometry.rotation_from_rpy(0.1, 0.0, 0.0)[2, 1] > 0


BATCH = np.random.default_rng(0).normal(size=(2, 5, 3))
OTHER = np.random.default_rng(1).normal(size=(5, 3))  # broadcast against the batch


@pytest.mark.parametrize(
    "function",
    [
        geometry.compose,
        geometry.between,
        lambda a, b: geometry.compose_jacobians(a, b)[0],
        lambda a, b: geometry.compose_jacobians(a, b)[1],
        lambda a, b: geometry.between_jacobians(a, b)[0],
        lambda a, b: geometry.between_jacobians(a, b)[1],
    ],
)
def test_a_batch_of_pairs_is_its_members(function: Callable[[Array, Array], Array]) -> None:
    whole = function(BATCH, OTHER)
    singles = np.array([[function(a, b) for a, b in zip(row, OTHER, strict=True)] for row in BATCH])
    assert (whole == singles).all()


@pytest.mark.parametrize(
    "function",
    [
        geometry.wrap,
        geometry.inverse,
        geometry.exp,
        geometry.log,
        geometry.lift,
        geometry.skew,
        geometry.so3_exp,
        lambda v: geometry.project(geometry.lift(v)),
        lambda v: geometry.inverse_transform(geometry.lift(v)),
        lambda v: geometry.transform(geometry.so3_exp(v), v),
    ],
)
def test_a_batch_is_its_members(function: Callable[[Array], Array]) -> None:
    singles = np.array([[function(v) for v in row] for row in BATCH])
    assert np.abs(function(BATCH) - singles).max() < 1e-15
