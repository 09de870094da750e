"""Scores are means; their intervals cover as they promise; prices are of paired episodes."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from grouser.agents.episode import Episode
from grouser.agents.evaluation import contrast, interval, open_closed_gap, score

EPISODE = Episode(
    policy="pursuit",
    estimator="dead-reckoning",
    seed=0,
    outcome="success",
    success=True,
    spl=0.9,
    soft_spl=0.88,
    collision=False,
    time_s=20.0,
    path_length_m=6.0,
    shortest_path_m=5.4,
    goals_reached=1,
    distance_to_goal_m=0.1,
    believed_distance_to_goal_m=0.14,
    position_error_m=0.05,
    lost=0.0,
)
CRASH = replace(EPISODE, outcome="collision", success=False, spl=0.0, collision=True)
MISS = replace(EPISODE, outcome="missed", success=False, spl=0.0)
LATE = replace(EPISODE, outcome="timeout", success=False, spl=0.0)


def seeded(episodes: Sequence[Episode]) -> list[Episode]:
    return [replace(episode, seed=seed) for seed, episode in enumerate(episodes)]


def test_scores_are_means_over_episodes() -> None:
    mine = seeded([EPISODE, EPISODE, CRASH, MISS, LATE])
    scored = score(mine, seeded([EPISODE] * 5))
    assert (scored.estimator, scored.episodes) == ("dead-reckoning", 5)
    assert scored.success == pytest.approx(0.4) and scored.spl == pytest.approx(0.36)
    assert (scored.collisions, scored.missed, scored.timeouts) == pytest.approx((0.2, 0.2, 0.2))
    assert scored.price_of_estimation == pytest.approx(0.54)
    assert scored.spl_low < scored.spl < scored.spl_high
    assert scored.price_low < scored.price_of_estimation < scored.price_high
    assert scored.time_s == pytest.approx(20.0)


def test_the_price_is_paired_by_seed_whatever_the_order() -> None:
    rng = np.random.default_rng(0)
    hard = rng.random(40)
    truths = [replace(EPISODE, seed=k, spl=float(hard[k])) for k in range(40)]
    mine = [replace(EPISODE, seed=k, spl=float(hard[k]) - 0.1) for k in range(40)]
    scored = score(mine[::-1], truths)
    # Episodes differ much, the two in each little: paired, the price is known well.
    assert scored.price_low == pytest.approx(0.1) == scored.price_high
    assert scored.spl_high - scored.spl_low > 0.1


def test_drivers_are_compared_in_the_same_episodes() -> None:
    rng = np.random.default_rng(0)
    hard = rng.random(40)
    worse = [replace(EPISODE, seed=k, spl=float(hard[k]) - 0.2) for k in range(40)]
    better = [replace(EPISODE, policy="learned", seed=k, spl=float(hard[k])) for k in range(40)]
    found = contrast(better[::-1], worse)
    assert (found.policy, found.against) == ("learned", "pursuit")
    assert found.spl_gain_low == pytest.approx(0.2) == found.spl_gain_high
    assert found.success_gain == found.success_gain_low == found.success_gain_high == 0
    with pytest.raises(ValueError, match=r"in the same episodes; got seeds \[0\] and \[0, 1\]"):
        contrast(seeded([EPISODE]), seeded([EPISODE, CRASH]))


def test_ground_truth_costs_nothing() -> None:
    scored = score(seeded([EPISODE, CRASH]), seeded([EPISODE, CRASH]))
    assert scored.price_of_estimation == scored.price_low == scored.price_high == 0


def test_episodes_without_a_partner_are_refused() -> None:
    with pytest.raises(ValueError, match=r"is paired: .* got seeds \[0, 1\] and \[0\]"):
        score(seeded([EPISODE, CRASH]), seeded([EPISODE]))
    with pytest.raises(ValueError, match="is paired"):
        score([], [])


def test_the_interval_covers_the_mean_as_often_as_it_says() -> None:
    rng = np.random.default_rng(1)
    covered = 0
    for _ in range(200):
        low, high = interval((rng.random(60) < 0.8).astype(float))
        covered += low <= 0.8 <= high
    assert 0.88 < covered / 200 <= 0.99


def test_the_gap_compares_both_orders() -> None:
    ate = {"a": 0.1, "b": 0.2, "c": 0.3, "d": 0.4}
    same = open_closed_gap("pursuit", ate, {"a": 0.9, "b": 0.8, "c": 0.7, "d": 0.6})
    assert same.kendall_tau == pytest.approx(1.0)
    assert same.by_ate == same.by_spl == ("a", "b", "c", "d")
    swapped = open_closed_gap("pursuit", ate, {"a": 0.8, "b": 0.9, "c": 0.7, "d": 0.6})
    assert swapped.kendall_tau == pytest.approx(4 / 6)  # five pairs agree, one does not
    assert swapped.by_spl == ("b", "a", "c", "d")
    tied = open_closed_gap("pursuit", ate, dict.fromkeys(ate, 1.0))
    assert tied.kendall_tau is None and tied.p_value is None


def test_a_gap_takes_two_estimators_with_both_figures() -> None:
    with pytest.raises(ValueError, match="to rank estimators takes two or more"):
        open_closed_gap("pursuit", {"a": 0.1}, {"a": 0.9})
    with pytest.raises(ValueError, match=r"\['a', 'b'\] and \['a', 'c'\]"):
        open_closed_gap("pursuit", {"a": 0.1, "b": 0.2}, {"a": 0.9, "c": 0.1})
