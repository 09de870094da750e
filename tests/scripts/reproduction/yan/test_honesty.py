"""Two measures of one error: where they agree, and where only one can be honest."""

import numpy as np
import pytest

from grouser.estimators.evaluation.consistency import nees
from grouser.geometry import Array, compose, exp
from grouser.scripts.reproduction.yan.honesty import bounds, leaves_at, plane_nees

P = np.diag([0.04, 0.02, 0.001])
PLACE = np.array([20.0, -35.0, 0.8])


def motions(sigmas: Array, n: int) -> Array:
    return exp(np.random.default_rng(0).normal(size=(n, 3)) * sigmas)


def test_small_errors_are_the_same_by_either_measure() -> None:
    estimate = np.tile(PLACE, (5, 1))
    errors = 1e-6 * np.random.default_rng(1).normal(size=(5, 3))
    covariances = np.tile(P, (5, 1, 1))
    by_differences = nees(estimate + errors, estimate, covariances)
    np.testing.assert_allclose(
        plane_nees(estimate + errors, estimate, covariances), by_differences, rtol=1e-4
    )


@pytest.mark.parametrize("degrees", [1.0, 20.0])
def test_a_plane_that_is_turned_is_honest_by_its_motion_however_far(degrees: float) -> None:
    """The truth is the estimate after a motion of the plane drawn from what the filter says."""
    sigmas, n = np.array([0.2, 0.2, np.radians(degrees)]), 4000
    estimate = np.tile(PLACE, (n, 1))
    truth = compose(motions(sigmas, n), estimate)
    J = np.array([[1, 0, -PLACE[1]], [0, 1, PLACE[0]], [0, 0, 1]])
    covariances = np.tile(J @ np.diag(sigmas**2) @ J.T, (n, 1, 1))
    assert plane_nees(truth, estimate, covariances).mean() == pytest.approx(3, abs=0.15)
    by_differences = nees(truth, estimate, covariances).mean()
    if degrees > 10:
        assert by_differences > 20, "a sickle is no ellipse"
    else:
        assert by_differences == pytest.approx(3, abs=0.3)


def test_bounds_hold_what_they_say() -> None:
    low, high = bounds(3 * 50, 50)
    means = np.random.default_rng(2).chisquare(3, (4000, 50)).mean(axis=1)
    assert np.mean((means > low) & (means < high)) == pytest.approx(0.95, abs=0.015)


def test_where_values_leave() -> None:
    amounts = [0.0, 1.0, 2.0, 4.0]
    assert leaves_at(amounts, [3.0, 3.0, 3.0, 5.0], 2.0, 4.0) == pytest.approx(3.0)
    assert leaves_at(amounts, [3.0, 3.0, 1.0, 3.0], 2.0, 4.0) == pytest.approx(1.5)
    assert leaves_at(amounts, [9.0, 3.0, 3.0, 3.0], 2.0, 4.0) == 0.0
    assert np.isnan(leaves_at(amounts, [3.0] * 4, 2.0, 4.0))
