"""What a slope does to an increment: projection, creep and slip, against geometry and samples."""

import numpy as np
import pytest

from grouser.estimators.inclination import levelling
from grouser.estimators.slope import (
    SlopeOptions,
    on_slope,
    on_steep,
    slip_covariance,
    unknown_covariance,
)
from grouser.estimators.visual.prediction import Increment
from grouser.geometry import Array, rotation_from_rpy

CREEP = np.array([0.4, 0.05])
TILTS = [(0.2, 0.1), (-0.15, 0.25), (0.0, -0.3)]
MOTIONS = [(0.04, 0.003, 0.05), (-0.03, -0.002, 0.02), (0.0, 0.001, -0.06)]


def vertical(roll: float, pitch: float) -> Array:
    up: Array = rotation_from_rpy(roll, pitch, 0.7)[2]
    return up


def increment(pose: Array) -> Increment:
    return Increment(pose, np.diag([1e-4, 4e-5, 1e-4]), np.arange(6.0).reshape(3, 2) / 10)


@pytest.mark.parametrize("tilt", TILTS)
def test_a_motion_in_the_robots_plane_is_projected_along_its_heading(
    tilt: tuple[float, float],
) -> None:
    R = rotation_from_rpy(*tilt, 0.7)
    heading = np.arctan2(R[1, 0], R[0, 0])
    in_plane = np.array([0.3, -0.2])
    in_world = (R[:, :2] @ in_plane)[:2]
    c, s = np.cos(heading), np.sin(heading)
    expected = np.array([[c, s], [-s, c]]) @ in_world
    assert levelling(R[2])[:2, :2] @ in_plane == pytest.approx(expected)


def test_level_ground_leaves_an_increment_as_it_is() -> None:
    level = increment(np.array(MOTIONS[0]))
    same = on_slope(level, np.array([0.0, 0.0, 1.0]), CREEP)
    assert np.array_equal(same.pose, level.pose)
    assert np.array_equal(same.covariance, level.covariance)
    assert np.array_equal(same.by_biases, np.column_stack([level.by_biases, np.zeros((3, 2))]))


def test_it_creeps_downhill_whichever_way_it_turns_and_drives() -> None:
    nose_up, left_up = np.array([0.2, 0.0, 0.98]), np.array([0.0, 0.2, 0.98])
    for turn in (0.1, -0.1):
        on_the_spot = increment(np.array([0.0, 0.0, turn]))
        assert on_slope(on_the_spot, nose_up, CREEP).pose == pytest.approx([-0.008, 0, turn])
        assert on_slope(on_the_spot, left_up, CREEP).pose == pytest.approx([0, -0.008, turn])
    for way in (0.1, -0.1):
        moved = on_slope(increment(np.array([way, 0.0, 0.0])), left_up, CREEP).pose
        assert moved[1] == pytest.approx(-0.05 * 0.2 * 0.1)


@pytest.mark.parametrize("tilt", TILTS)
@pytest.mark.parametrize("motion", MOTIONS[:2])
def test_its_derivatives_are_those_of_finite_differences(
    motion: tuple[float, float, float], tilt: tuple[float, float]
) -> None:
    level, up, h = increment(np.array(motion)), vertical(*tilt), 1e-6

    def pose(biases: Array) -> Array:
        moved = increment(level.pose + level.by_biases @ biases[:2])
        return on_slope(moved, up, CREEP + biases[2:]).pose

    by_biases = on_slope(level, up, CREEP).by_biases
    for k in range(4):
        step = h * np.eye(4)[k]
        expected = (pose(step) - pose(-step)) / (2 * h)
        assert np.abs(by_biases[:, k] - expected).max() < 1e-9


def test_the_covariance_is_that_of_samples() -> None:
    rng, level, up = np.random.default_rng(0), np.array([0.1, 0.01, 0.3]), vertical(0.2, -0.1)
    noise = np.diag([1e-5, 4e-6, 1e-4])
    told = on_slope(Increment(level, noise, np.zeros((3, 0))), up, CREEP).covariance
    samples = rng.multivariate_normal(level, noise, size=20_000)
    moved = [on_slope(increment(sample), up, CREEP).pose for sample in samples]
    sampled = np.cov(np.array(moved).T)
    scale = np.sqrt(np.outer(np.diag(sampled), np.diag(sampled)))
    assert np.abs((told - sampled) / scale).max() < 0.05


def test_slip_adds_up_with_turns_and_bumps_however_they_are_divided() -> None:
    options = SlopeOptions()
    whole = slip_covariance(0.8, 0.04, 0.0, 0.6, options)
    assert 8 * slip_covariance(-0.1, 0.04, 0.0, 0.6, options) == pytest.approx(whole)
    assert np.sqrt(whole[2, 2]) == pytest.approx(options.turn_slip * 0.2 * np.sqrt(0.8))
    bump = slip_covariance(0.0, 0.0, 0.05, 0.6, options)
    assert np.sqrt(bump[0, 0]) == pytest.approx(options.slide_bump * 0.6 * 0.05)
    assert not slip_covariance(0.0, 0.04, 0.0, 0.6, options).any()


def test_a_slope_that_nothing_tells_makes_a_robot_creep_in_a_direction_that_nothing_tells() -> None:
    """Against a slope that keeps its direction for 2 rad of turns, and then has another one."""
    options = SlopeOptions(slide=0.0, turn_slip=0.0, unknown=0.1)
    told = unknown_covariance(90.0, 0.6, options)
    rng = np.random.default_rng(0)
    held = 90 / options.unknown_for
    downhill = rng.normal(size=(4000, round(held), 2)) * 0.1 / np.sqrt(2)
    crept = (0.6 * options.creep_turning * options.unknown_for * downhill).sum(axis=1)
    # Held for a time that ends at random, it lasts twice as long as on average: hence the 2.
    assert 2 * np.var(crept, axis=0) == pytest.approx(np.diag(told)[:2], rel=0.1)
    assert told[2, 2] == 0.0


@pytest.mark.parametrize("tilt", TILTS)
@pytest.mark.parametrize("motion", MOTIONS)
def test_a_slope_that_is_roughly_known_makes_unsure_however_it_lies(
    motion: tuple[float, float, float], tilt: tuple[float, float]
) -> None:
    """As one that nothing tells does, of which it is known how steep slopes are."""
    level, up = increment(np.array(motion)), vertical(*tilt)
    steep = on_steep(level, up, 0.6, SlopeOptions())
    assert np.array_equal(steep.pose, level.pose) and steep.by_biases is level.by_biases
    told = SlopeOptions(unknown=float(np.sqrt(1 - up[2] ** 2)))
    expected = unknown_covariance(motion[2], 0.6, told)
    assert steep.covariance - level.covariance == pytest.approx(expected, abs=1e-15)
    same = on_steep(level, np.array([0.0, 0.0, 1.0]), 0.6, SlopeOptions())
    assert np.array_equal(same.covariance, level.covariance)


def test_options_out_of_range_are_refused() -> None:
    with pytest.raises(ValueError, match=r"SlopeOptions\.slide must be zero or more, got -1"):
        SlopeOptions(slide=-1.0)
