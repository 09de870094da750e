"""The variance factor: found from innovations, whatever else makes them, and from the prior alone
where they say nothing."""

import numpy as np
import pytest

from grouser.estimators.visual.variance_factor import Innovation, VarianceFactor
from grouser.geometry import Array

Q = np.array([[4.0, 1.0, 0.5], [1.0, 3.0, 0.2], [0.5, 0.2, 2.0]])
R = np.diag([0.5, 1.0, 2.0])


def innovation(rng: np.random.Generator, factor: float, noise: Array) -> Innovation:
    error = rng.multivariate_normal(np.zeros(3), factor * Q + noise)
    return Innovation(error, Q + noise, Q)


@pytest.mark.parametrize("truth", [0.1, 0.4, 1.0, 6.0])
def test_three_numbers_at_a_time_tell_the_truth(truth: float) -> None:
    rng, factor = np.random.default_rng(1), VarianceFactor(prior=2.0, memory=5000.0)
    for _ in range(3000):
        factor.learn(innovation(rng, truth, R))
    assert factor.value == pytest.approx(truth, rel=0.1, abs=0.03)


@pytest.mark.parametrize("truth", [0.1, 0.4, 1.0, 6.0])
def test_one_number_at_a_time_does(truth: float) -> None:
    rng, factor = np.random.default_rng(2), VarianceFactor(prior=2.0, memory=5000.0)
    for _ in range(3000):
        factor.learn_one(float(rng.normal(0, np.sqrt(truth * 2.0 + 0.5))) ** 2, 2.0, 0.5)
    assert factor.value == pytest.approx(truth, rel=0.1, abs=0.02)


def test_what_says_nothing_leaves_the_prior() -> None:
    rng, factor = np.random.default_rng(3), VarianceFactor(prior=2.0, memory=50.0)
    for _ in range(200):
        factor.learn(innovation(rng, 0.1, 1e4 * R))
        factor.learn_one(float(rng.normal(0, 100.0)) ** 2, 0.1, 1e4)
        factor.learn_one(0.0, 0.0, 0.5)  # nothing was predicted with noise
    assert factor.value == pytest.approx(1.0, abs=0.02)


def test_slip_is_learnt_at_once_and_forgotten_in_time() -> None:
    rng, factor = np.random.default_rng(4), VarianceFactor(prior=2.0, memory=20.0)
    for _ in range(100):
        factor.learn(innovation(rng, 0.1, 0.1 * R))
    assert factor.value < 0.3
    factor.learn(innovation(rng, 100.0, 0.1 * R))
    assert factor.value > 1.0
    for _ in range(200):
        factor.learn(innovation(rng, 0.1, 0.1 * R))
    assert factor.value < 0.3


def test_the_worst_there_is_does_not_break_it() -> None:
    factor = VarianceFactor(prior=2.0, memory=20.0)
    factor.learn(Innovation(np.full(3, 1e9), Q + R, Q))
    assert 1.0 < factor.value <= 100.0
    for _ in range(1000):
        factor.learn(Innovation(np.zeros(3), Q + R, Q))
    assert factor.value > 0.0
