"""Emulated errors are those of their model, and their covariance is honest."""

import numpy as np
import pytest

from grouser.estimators.emulation.process import ErrorProcess, emulate, modelled_sigmas
from grouser.estimators.evaluation.consistency import nees
from grouser.geometry import between
from tests.estimators.emulation.models import drifting, model, way


def test_without_errors_it_is_the_truth() -> None:
    truth = way(200)
    told, covariance = emulate(model(), truth, np.random.default_rng(0))
    np.testing.assert_allclose(told, truth, atol=1e-12)
    assert not covariance.any()


@pytest.mark.parametrize("correction", [0.0, 0.05])
def test_the_covariance_is_that_of_many_draws(correction: float) -> None:
    errors = drifting(correction=np.full(3, correction), bias_mean=np.zeros((2, 3, 4)))
    truth, n = way(60), 600
    rng = np.random.default_rng(1)
    told, covariance = zip(*(emulate(errors, truth, rng) for _ in range(n)), strict=True)
    for frame in (1, 20, 60):
        off = np.array(told)[:, frame] - truth[frame]
        sample, said = off.T @ off / n, covariance[0][frame]
        # Six sigmas of a sample covariance's entries (Wishart), and a hundredth for linearisation.
        allowed = np.sqrt((said**2 + np.outer(np.diag(said), np.diag(said))) / n)
        assert (np.abs(sample - said) < 6 * allowed + 0.01 * np.abs(said).max()).all(), frame
        values = nees(np.tile(truth[frame], (n, 1)), np.array(told)[:, frame], np.array([said] * n))
        assert np.mean(values) == pytest.approx(3.0, abs=6 * np.sqrt(6 / n))


def test_errors_are_taken_back_where_it_tracks_and_nowhere_else() -> None:
    growth = np.full((3, 3, 3), 1e-6)
    tracking = model(growth=growth, correction=np.full(3, 0.2))
    coasting = model(growth=growth, correction=np.full(3, 0.2), first_status=[0, 1, 0])
    truth = way(400)
    ends = {
        name: np.std([emulate(m, truth, np.random.default_rng(k))[0][-1, 2] for k in range(30)])
        for name, m in {"tracking": tracking, "coasting": coasting}.items()
    }
    # A stationary error of sigma sqrt(q / (1 - 0.8^2)) against a random walk's sqrt(400 q).
    assert ends["tracking"] < 0.2 * ends["coasting"]


def test_what_is_found_again_takes_the_error_back() -> None:
    """The step that ends a time without TRACKING leaves a share of the error and of its sigma."""
    growth = np.zeros((3, 3, 3))
    growth[1, :, 0] = 1e-4
    errors = model(growth=growth, recovery=np.full(3, 0.75))
    truth, rng = np.zeros((51, 3)), np.random.default_rng(4)
    ratios, n = [], 200
    for _ in range(n):
        process = ErrorProcess(errors, errors.bias_mean, truth[0])
        for pose in truth[1:]:
            before, sigma = process.step(pose, 1, rng.standard_normal(6))
        after, found = process.step(truth[0], 0, rng.standard_normal(6))
        ratios.append(after[2] / before[2])
        np.testing.assert_allclose(found[2, 2], sigma[2, 2] / 16, rtol=1e-9)
        later, _ = process.step(truth[0], 0, rng.standard_normal(6))
        np.testing.assert_allclose(later, after, atol=1e-12)
    np.testing.assert_allclose(ratios, 0.25, rtol=1e-6)


def test_modelled_sigmas_do_not_depend_on_draws() -> None:
    errors, truth = drifting(), way(50)
    sigma = modelled_sigmas(errors, truth, np.zeros(51, dtype=np.int64))
    _, covariance = emulate(errors, truth, np.random.default_rng(3))
    np.testing.assert_allclose(sigma[:, 1], np.sqrt(covariance[:, 2, 2]), rtol=1e-12)


def test_confidence_scales_what_is_told() -> None:
    truth, rng = way(50), np.random.default_rng
    _, honest = emulate(drifting(), truth, rng(0))
    _, modest = emulate(drifting(confidence=np.tile([2.0, 3.0], (2, 1))), truth, rng(0))
    np.testing.assert_allclose(modest[:, :2, :2], 4 * honest[:, :2, :2], rtol=1e-12)
    np.testing.assert_allclose(modest[:, :2, 2], 6 * honest[:, :2, 2], rtol=1e-12)
    np.testing.assert_allclose(modest[:, 2, 2], 9 * honest[:, 2, 2], rtol=1e-12)


def test_errors_lie_in_the_robots_frame() -> None:
    """A tenth too short forwards is a tenth too short wherever the start's axes point."""
    short = np.zeros((2, 3, 4))
    short[0, 0, 0] = -0.1
    truth = np.column_stack([np.zeros(11), np.linspace(0, 1, 11), np.full(11, np.pi / 2)])
    told, _ = emulate(model(bias_mean=short), truth, np.random.default_rng(0))
    np.testing.assert_allclose(between(truth[-1], told[-1]), [-0.1, 0, 0], atol=1e-12)
