"""RANSAC draws what it says, as often as it must, and finds what is there."""

from itertools import combinations
from math import comb

import numpy as np
import pytest
from numpy.typing import NDArray

from grouser.estimators.visual.ransac import (
    BATCH,
    MOST_TRIALS,
    Consensus,
    minimal_samples,
    ransac,
    trials_needed,
)
from grouser.geometry import Array


def test_samples_are_of_different_indices_and_all_are_equally_likely() -> None:
    drawn = np.sort(minimal_samples(6, 3, 20000, np.random.default_rng(0)), axis=1)
    kinds, counts = np.unique(drawn, axis=0, return_counts=True)
    assert [tuple(kind) for kind in kinds] == list(combinations(range(6), 3))
    expected = 20000 / comb(6, 3)
    assert (np.abs(counts - expected) < 5 * np.sqrt(expected)).all()


@pytest.mark.parametrize(
    ("share", "size", "needed"),
    [
        (1.0, 3, 1), (0.7, 2, 7), (0.5, 2, 17), (0.7, 3, 11), (0.5, 3, 35), (0.5, 5, 146),
        (0.0, 3, MOST_TRIALS),
    ],
)  # fmt: skip
def test_trials_needed_as_in_hartley_and_zisserman(share: float, size: int, needed: int) -> None:
    """Their table 4.3, at 99 %."""
    assert trials_needed(share, size) == needed


def line_fit(
    x: Array, y: Array, limit: float, rng: np.random.Generator
) -> tuple[Consensus | None, list[int]]:
    """A line y = a x + b through two of the points, and how many were judged at a time."""
    judged: list[int] = []

    def propose(samples: NDArray[np.intp]) -> Array:
        dx = x[samples[:, 1]] - x[samples[:, 0]]
        good = dx != 0
        one, other = samples[good].T
        a = (y[other] - y[one]) / dx[good]
        return np.column_stack([a, y[one] - a * x[one]])

    def judge(lines: Array) -> Array:
        judged.append(len(lines))
        return np.asarray(((lines[:, :1] * x + lines[:, 1:] - y) / limit) ** 2)

    return ransac(np.arange(len(x)), 2, propose, judge, rng), judged


def test_a_line_is_found_among_wrong_points() -> None:
    rng = np.random.default_rng(1)
    x = rng.uniform(0, 10, 60)
    y = np.where(np.arange(60) < 30, 0.5 * x + 2, rng.uniform(-9, 9, 60))
    found, judged = line_fit(x, y, 1e-6, rng)
    assert found is not None
    np.testing.assert_allclose(found.model, [0.5, 2.0], atol=1e-9)
    assert found.inliers.tolist() == [True] * 30 + [False] * 30
    assert found.trials == sum(judged) == BATCH  # one round is enough for half of the points


def test_the_fewer_agree_the_more_is_drawn() -> None:
    rng = np.random.default_rng(2)
    trials = []
    for right in (60, 20, 9, 3):
        x = rng.uniform(0, 10, 60)
        y = np.where(np.arange(60) < right, 0.5 * x + 2, rng.uniform(-9, 9, 60))
        found, judged = line_fit(x, y, 1e-6, rng)
        assert found is not None and found.trials == sum(judged)
        trials.append(found.trials)
    assert trials == sorted(trials) and trials[0] == BATCH and trials[-1] == MOST_TRIALS


def test_where_no_sample_gives_a_model_there_is_none() -> None:
    rng = np.random.default_rng(3)
    assert line_fit(np.ones(10), np.arange(10.0), 1.0, rng) == (None, [])
    assert line_fit(np.ones(1), np.ones(1), 1.0, rng) == (None, [])
