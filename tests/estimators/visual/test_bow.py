"""How far disparities bow: the mean of what keyframes say, held by what would be no wonder."""

import numpy as np
import pytest

from grouser.estimators.visual.bow import NO_BOW, Bow, BowFit

SPREAD = 1.0


def learnt(seed: int, true: float, keyframes: int, wrong: float = 0.0) -> Bow:
    fit, rng = BowFit(), np.random.default_rng(seed)
    for _ in range(keyframes):
        off = 3.0 if rng.random() < wrong else 0.2 * rng.normal()
        fit.learn(Bow(true + off, 0.2), fit.estimate(SPREAD))
    return fit.estimate(SPREAD)


def test_before_anything_is_seen_it_is_none_and_as_unsure_as_the_rows_make_it() -> None:
    assert BowFit().estimate(0.7) == Bow(0.0, 0.7)


def test_of_a_pair_as_good_as_its_calibration_there_is_none() -> None:
    fit = BowFit()
    fit.learn(Bow(0.5, 0.1), NO_BOW)
    assert fit.estimate(0.0) == NO_BOW


@pytest.mark.parametrize("seed", range(4))
def test_it_is_found_and_as_sure_as_said(seed: int) -> None:
    bow = learnt(seed, 0.4, 40)
    assert abs(bow.px - 0.4) < 3 * bow.sigma < 0.25


def test_a_wrong_keyframe_in_ten_moves_it_little() -> None:
    assert abs(learnt(0, 0.4, 60, wrong=0.1).px - 0.4) < 0.15


def test_a_bow_that_changes_is_followed() -> None:
    fit = BowFit()
    for true in [0.4] * 50 + [-0.4] * 100:
        fit.learn(Bow(true, 0.1), fit.estimate(SPREAD))
    assert fit.estimate(SPREAD).px == pytest.approx(-0.4, abs=0.15)
