"""The NEES is three for honest estimates, and only for those."""

import numpy as np
import pytest

from grouser.estimators.evaluation.consistency import (
    mean_bounds,
    nees,
    with_reference_noise,
)
from grouser.geometry import Array, between, compose, wrap

N = 4000


def errors_and_covariances(seed: int) -> tuple[Array, Array]:
    """Errors (N, 3) drawn from covariances (N, 3, 3) that all differ."""
    rng = np.random.default_rng(seed)
    roots = rng.normal(0, 1, (N, 3, 3)) * np.array([0.3, 0.2, 0.02])[:, None]
    errors = (roots @ rng.normal(0, 1, (N, 3, 1)))[:, :, 0]
    return errors, np.asarray(roots @ roots.transpose(0, 2, 1))


def test_honest_estimates_have_a_nees_of_three() -> None:
    errors, P = errors_and_covariances(0)
    truth = np.random.default_rng(1).uniform(-3, 3, (N, 3))
    estimate = truth + errors
    estimate[:, 2] = wrap(estimate[:, 2])
    values = nees(truth, estimate, P)
    low, high = mean_bounds(N, confidence=0.999)
    assert low < np.nanmean(values) < high


def test_overconfident_estimates_do_not() -> None:
    errors, P = errors_and_covariances(0)
    _, high = mean_bounds(N)
    assert np.nanmean(nees(np.zeros((N, 3)), errors, P / 2)) > high


def test_the_heading_error_is_wrapped() -> None:
    truth = np.array([[0, 0, np.pi - 0.01]])
    estimate = np.array([[0, 0, -np.pi + 0.01]])
    values = nees(truth, estimate, np.eye(3)[None])
    assert values[0] == pytest.approx(0.02**2)


@pytest.mark.parametrize(
    "P",
    [
        np.zeros((3, 3)),
        np.diag([1.0, 1.0, 0.0]),
        np.outer([0.1, 0.2, 0.3], [0.1, 0.2, 0.3]),
        np.array([[1.0, 1, 0], [1, 1, 0], [0, 0, 1]]) * 1e-8,
    ],
    ids=["zero", "known heading", "rank one", "rank two"],
)
def test_a_singular_covariance_has_no_nees(P: Array) -> None:
    values = nees(np.zeros((2, 3)), np.full((2, 3), 0.1), np.array([P, np.eye(3)]))
    assert np.isnan(values[0])
    assert values[1] == pytest.approx(0.03)


def test_a_small_covariance_is_not_a_singular_one() -> None:
    """Micrometres beside radians: what counts is the correlation, not the unit."""
    P = np.diag([1e-14, 1e-14, 1e-2])
    assert nees(np.zeros((1, 3)), np.array([[1e-7, 1e-7, 0.1]]), P[None])[0] == pytest.approx(3)


def test_the_bounds_are_those_of_the_textbook() -> None:
    """30 runs, 3 dimensions, 95 %: [2.19, 3.94]."""
    assert mean_bounds(30) == pytest.approx((2.19, 3.94), abs=0.005)


@pytest.mark.parametrize(("n", "confidence"), [(0, 0.95), (5, 0.0), (5, 1.0)])
def test_impossible_bounds_are_refused(n: int, confidence: float) -> None:
    with pytest.raises(ValueError, match=r"n >= 1 runs and a confidence between 0 and 1; got"):
        mean_bounds(n, confidence=confidence)


def test_a_reference_that_is_noisy_is_allowed_for() -> None:
    """Honest estimates beside reference poses with errors of their own, the first one's too."""
    rng = np.random.default_rng(3)
    sigmas, values = np.array([0.04, 0.04, 0.007]), []
    P = np.tile(np.diag([0.02, 0.03, 0.004]) ** 2, (60, 1, 1))
    P[0] = 0
    for _ in range(60):
        truth = rng.uniform(-8, 8, (60, 3))
        truth[0] = 0
        estimate = truth + rng.normal(size=(60, 3)) * [0.02, 0.03, 0.004]
        estimate[0] = 0
        noisy = compose(truth, rng.normal(size=(60, 3)) * sigmas)
        reference = between(noisy[0], noisy)
        allowed = with_reference_noise(reference, P, sigmas)
        values.append((nees(reference, estimate, allowed), nees(reference, estimate, P)))
    assert np.nanmean([v for v, _ in values]) == pytest.approx(3, abs=0.3)
    assert np.nanmean([v for _, v in values]) > 10
    assert np.isnan(values[0][0][0]), "at the start both are zero"
