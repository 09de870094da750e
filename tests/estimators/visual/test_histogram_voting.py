"""The vote of all points: its median, its electorate, and what it costs against RANSAC."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from grouser.estimators.visual.histogram_voting import HistogramVoting, elect
from tests.estimators.visual.clouds import matched, near_zero, six, stereo

values = st.lists(st.floats(-1.0, 1.0), min_size=1, max_size=30)


@given(values, st.integers(0, 100))
def test_no_other_window_of_a_bins_width_holds_more_votes(numbers: list[float], seed: int) -> None:
    """Against a count around every place where a bin could begin or end."""
    v = np.array(numbers)
    sigma = np.random.default_rng(seed).uniform(0.01, 0.2)
    elected, agree, votes = elect(v, np.full(len(v), sigma))
    assert elected is not None and votes == len(v) and agree.any()
    width = 2 * sigma
    most = max(int(((v >= start) & (v <= start + width)).sum()) for start in v)
    around = [((v >= s) & (v <= s + width)).sum() for s in v if s <= elected <= s + width]
    assert max(around) == most
    np.testing.assert_array_equal(agree, np.abs(v - elected) <= 3 * sigma)


def test_a_peak_beats_a_wider_crowd() -> None:
    """Forty votes spread over the whole range, fifteen at one place: the mean knows nothing."""
    for rng in np.random.default_rng(0).spawn(50):
        v = np.concatenate([rng.normal(0.3, 0.01, 15), rng.uniform(-1, 1, 40)])
        elected, agree, _ = elect(v, np.full(55, 0.01))
        assert elected == pytest.approx(0.3, abs=0.015) and agree[:15].mean() > 0.85


def test_values_without_a_finite_sigma_do_not_vote() -> None:
    v, sigmas = np.array([5.0, np.nan, 1.0, 5.0]), np.array([np.inf, 0.1, 0.1, np.nan])
    elected, agree, votes = elect(v, sigmas)
    assert elected == 1.0 and agree.tolist() == [False, False, True, False] and votes == 1
    nobody, agree, votes = elect(v, np.full(4, np.inf))
    assert nobody is None and not agree.any() and votes == 0


def test_every_match_votes_once_for_the_turn_and_once_for_the_chord_if_it_agrees() -> None:
    matches = matched(np.random.default_rng(1), stereo(), six(0.05, 0.2))
    prior = near_zero(1e-6, 1e-6, 1e-6, 1e-6)
    found = HistogramVoting(stereo()).solve(matches, prior, np.random.default_rng(0))
    assert found is not None and found.trials == 128 and found.inliers.all()
