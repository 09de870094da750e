"""A fit finds the model that runs were drawn from, and the agreement tells models apart."""

import numpy as np
import pytest

from grouser.estimators.emulation.agreement import MEASURES, agreement
from grouser.estimators.emulation.error_model import ErrorModel
from grouser.estimators.emulation.fit import fit_error_model
from grouser.estimators.emulation.process import ErrorProcess
from grouser.estimators.emulation.record import Record
from tests.estimators.emulation.models import DT, drifting, model, record, way


@pytest.fixture(scope="module")
def fitted() -> ErrorModel:
    runs = [record(drifting(), 1200, seed) for seed in range(16)]
    return fit_error_model(runs, of="test", source="drawn")


def test_systematic_errors_are_found(fitted: ErrorModel) -> None:
    true = drifting()
    # Of 16 runs: the mean is known to a quarter of the spread, the spread to a sixth of itself.
    allowed = 4 * (true.bias_sigma / 4 + 0.003)
    assert (np.abs(fitted.bias_mean - true.bias_mean) < allowed).all()
    large = true.bias_sigma >= 0.01
    np.testing.assert_allclose(fitted.bias_sigma[large], true.bias_sigma[large], rtol=0.6)


def test_noise_is_found(fitted: ErrorModel) -> None:
    true = drifting()
    np.testing.assert_allclose(fitted.jitter[0], true.jitter[0], rtol=0.1)
    # The variance that a step of the drive's mean way and turn brings.
    step = np.array([1.0, 0.03, 0.04])
    np.testing.assert_allclose(fitted.growth[0] @ step, true.growth[0] @ step, rtol=0.15)


def test_nothing_is_taken_back_where_nothing_is(fitted: ErrorModel) -> None:
    assert not fitted.correction.any()


def test_what_is_taken_back_is_found() -> None:
    nothing = {"bias_mean": np.zeros((2, 3, 4)), "jitter": np.zeros((3, 3))}
    true = drifting(correction=np.full(3, 0.03), **nothing)
    found = fit_error_model([record(true, 1200, seed) for seed in range(8)], of="t", source="s")
    np.testing.assert_allclose(found.correction, true.correction, rtol=0.35)


def test_the_covariance_is_as_confident_as_the_estimator() -> None:
    boastful = drifting(confidence=np.tile([0.5, 0.25], (2, 1)))
    found = fit_error_model([record(boastful, 1200, seed) for seed in range(8)], of="t", source="s")
    np.testing.assert_allclose(found.confidence, boastful.confidence, rtol=0.35)


def lossy(errors: ErrorModel, seed: int) -> Record:
    """A run that is blind for 60 steps again and again."""
    truth, status = way(1000, seed), np.tile(np.repeat([0, 1], [40, 60]), 11)[:1001]
    process, rng = ErrorProcess(errors, errors.bias_mean, truth[0]), np.random.default_rng(seed)
    steps = [process.step(p, k, rng.standard_normal(6)) for p, k in zip(truth, status, strict=True)]
    told, covariance = (np.array(part) for part in zip(*steps, strict=True))
    return Record(DT, truth, told, covariance, status)


def test_what_a_recovery_takes_back_is_found() -> None:
    growth = np.zeros((3, 3, 3))
    growth[1, :, 0] = [1e-4, 1e-4, 1e-5]
    true = model(
        growth=growth,
        jitter=np.full((3, 3), 1e-3),
        recovery=np.array([0.7, 0.7, 0.9]),
        confidence=np.array([[1.0, 1.0], [0.5, 0.3]]),
    )
    found = fit_error_model([lossy(true, seed) for seed in range(8)], of="t", source="s")
    np.testing.assert_allclose(found.recovery, true.recovery, atol=0.08)
    np.testing.assert_allclose(found.confidence[1] / found.confidence[0], [0.5, 0.3], rtol=0.35)


def test_without_a_loss_no_recovery_is_claimed(fitted: ErrorModel) -> None:
    assert not fitted.recovery.any()


def test_loss_and_recovery_are_counted() -> None:
    status = np.tile(np.repeat([0, 1, 2], [14, 4, 2]), 50)
    run = record(drifting(), len(status) - 1, 0)
    lossy = Record(DT, run.truth, run.told, run.covariance, status)
    found = fit_error_model([lossy], of="t", source="s")
    wanted = [[13 / 14, 1 / 14, 0], [0, 3 / 4, 1 / 4], [49 / 99, 0, 50 / 99]]
    np.testing.assert_allclose(found.transitions, wanted, atol=1e-12)
    assert found.first_status.tolist() == [1, 0, 0]


def test_the_agreement_tells_models_apart() -> None:
    true = drifting()
    runs = [record(true, 400, seed) for seed in range(30)]
    alike = agreement(true, runs, seed=1).distances()
    unlike = agreement(model(jitter=np.full((3, 3), 0.03)), runs, seed=1).distances()
    assert set(alike) == set(MEASURES)
    assert all(alike[measure] < 0.35 for measure in MEASURES), alike
    assert all(unlike[measure] > alike[measure] + 0.2 for measure in MEASURES), unlike


def test_what_cannot_be_fitted_to_is_refused() -> None:
    with pytest.raises(ValueError, match="at least one run"):
        fit_error_model([], of="t", source="s")
    one = record(model(), 100, 0)
    other = Record(0.05, one.truth, one.told, one.covariance, one.status)
    with pytest.raises(ValueError, match=r"steps of \[0.05, 0.1\] s; fit to runs of one robot"):
        fit_error_model([one, other], of="t", source="s")


def test_a_blind_robot_errs_in_its_own_way() -> None:
    """Systematic errors while it does not track are told apart from those while it does."""
    mean = np.zeros((2, 3, 4))
    mean[1, 0, 0] = 0.2
    runs = []
    for seed in range(6):
        truth, status = way(600, seed), np.repeat([0, 1, 0], [300, 150, 151])
        process = ErrorProcess(drifting(), mean, truth[0])
        rng = np.random.default_rng(seed)
        steps = [
            process.step(p, k, rng.standard_normal(6)) for p, k in zip(truth, status, strict=True)
        ]
        told, covariance = (np.array(part) for part in zip(*steps, strict=True))
        runs.append(Record(DT, truth, told, covariance, status))
    found = fit_error_model(runs, of="t", source="s").bias_mean
    assert found[0, 0, 0] == pytest.approx(0.0, abs=0.03)
    assert found[1, 0, 0] == pytest.approx(0.2, abs=0.06)
