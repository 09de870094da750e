"""The arc of the tracks: exact, differentiable everywhere, noise as stated."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from grouser import geometry
from grouser.estimators.track_motion import (
    SideSlip,
    TrackNoise,
    arc_jacobian,
    arc_pose,
    chord,
    increment_jacobian,
    track_increment,
    track_increment_jacobian,
)
from grouser.geometry import Array

WIDTH = 0.55
# Spot turn, straight, reverse, rest, the series' seam, and the smallest motions.
TURNS = [0.0, 1e-9, -1e-7, 1e-4, 9.999e-3, 1.0001e-2, -0.05, 0.7, -1.6, 3.0]
ARCS = [0.0, 1e-7, 0.1, -0.3]


def increment(du: Array) -> Array:
    return arc_pose(*track_increment(du, WIDTH))


def numeric_jacobian(du: Array, step: float = 1e-6) -> Array:
    columns = []
    for axis in np.eye(2) * step:
        columns.append((increment(du + axis) - increment(du - axis)) / (2 * step))
    return np.stack(columns, axis=-1)


@pytest.mark.parametrize("turn", TURNS)
@pytest.mark.parametrize("arc_length", ARCS)
def test_arc_is_the_exponential_of_a_twist_without_side_slip(
    turn: float, arc_length: float
) -> None:
    expected = geometry.exp([arc_length, 0.0, turn])
    assert np.abs(arc_pose(turn, arc_length) - expected).max() < 1e-15


@given(turn=st.floats(-3.0, 3.0), arc_length=st.floats(-1.0, 1.0))
def test_two_halves_of_an_arc_make_the_arc(turn: float, arc_length: float) -> None:
    half = arc_pose(turn / 2, arc_length / 2)
    assert np.abs(geometry.compose(half, half) - arc_pose(turn, arc_length)).max() < 1e-14


@given(du=arrays(float, 2, elements=st.floats(-0.5, 0.5)))
def test_increment_jacobian_matches_finite_differences(du: Array) -> None:
    assert np.abs(increment_jacobian(du, WIDTH) - numeric_jacobian(du)).max() < 1e-6


@pytest.mark.parametrize("turn", TURNS)
def test_arc_jacobian_matches_finite_differences_beside_the_seam(turn: float) -> None:
    h, arc_length = 1e-6, 0.4
    by_turn = (arc_pose(turn + h, arc_length) - arc_pose(turn - h, arc_length)) / (2 * h)
    by_arc = (arc_pose(turn, arc_length + h) - arc_pose(turn, arc_length - h)) / (2 * h)
    expected = np.stack([by_turn, by_arc], axis=-1)
    assert np.abs(arc_jacobian(turn, arc_length) - expected).max() < 1e-8


def test_the_printed_input_matrix_is_not_the_jacobian() -> None:
    du = np.array([0.05, 0.25])  # SPEC 1.1: B differs where phi depends on the increments
    turn, arc_length = track_increment(du, WIDTH)
    printed = np.array([[math.cos(turn / 2)] * 2, [math.sin(turn / 2)] * 2, [0.0, 0.0]]) / 2
    assert np.abs(printed[:2] - increment_jacobian(du, WIDTH)[:2]).max() > 0.05


def test_chord_is_the_distance_covered_and_keeps_the_sign_of_reverse() -> None:
    pose = arc_pose(0.8, -0.3)
    assert chord(0.8, -0.3) == pytest.approx(-math.hypot(pose[0], pose[1]), abs=1e-15)
    assert chord(0.5, 0.0) == 0.0


def test_opposite_tracks_turn_on_the_spot_and_equal_tracks_go_straight() -> None:
    assert np.array_equal(increment(np.array([-0.1, 0.1])), [0.0, 0.0, 0.2 / WIDTH])
    assert np.array_equal(increment(np.array([0.1, 0.1])), [0.1, 0.0, 0.0])


def test_track_increment_jacobian_is_that_of_the_linear_map() -> None:
    du = np.array([0.03, 0.11])
    linear = track_increment_jacobian(WIDTH) @ du
    assert np.allclose(linear, track_increment(du, WIDTH), atol=1e-17)


def test_track_noise_grows_with_the_increment_and_never_vanishes() -> None:
    covariance = TrackNoise(scale=0.03, floor=0.0002).covariance(np.array([-0.1, 0.0]))
    assert np.allclose(covariance, np.diag([0.003**2 + 0.0002**2, 0.0002**2]), rtol=1e-12)


def test_side_slip_points_left_of_the_chord() -> None:
    covariance = SideSlip().covariance(1.0, 0.2)
    along = np.array([math.cos(0.5), math.sin(0.5), 0.0])
    assert np.abs(covariance @ along).max() < 1e-18
    assert np.trace(covariance) == pytest.approx((0.02 * 0.2 + 0.005 + 1e-5) ** 2)


def test_noise_refuses_negative_or_undefined_values() -> None:
    with pytest.raises(ValueError, match=r"TrackNoise\.scale must be zero or more, got -0\.1"):
        TrackNoise(scale=-0.1)
    with pytest.raises(ValueError, match=r"SideSlip\.floor must be zero or more, got nan"):
        SideSlip(floor=math.nan)
