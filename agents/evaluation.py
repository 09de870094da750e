"""Scores of drivers under estimators, with intervals, over the same episodes for all of them.

SPL: Anderson et al., On evaluation of embodied navigation agents, 2018. SoftSPL: Datta et al.,
Integrating egocentric localization for more realistic point-goal navigation agents, 2020.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy import stats

from grouser.agents.episode import Episode
from grouser.agents.goal_score import MISSED, TIMEOUT
from grouser.geometry import Array

BASELINE: Final = "ground-truth"
"""The estimator whose SPL the others are measured against."""

_RESAMPLES = 10_000
_CONFIDENCE = 0.95


@dataclass(frozen=True, slots=True)
class Score:
    """A driver's under an estimator: means over its episodes. `_low` and `_high` are the ends of a
    95 % bootstrap interval."""

    policy: str
    estimator: str
    pose_latency: float
    """How late estimates arrived, s."""
    episodes: int
    success: float
    success_low: float
    success_high: float
    spl: float
    spl_low: float
    spl_high: float
    soft_spl: float
    collisions: float
    """An episode; it ends one."""
    missed: float
    """Share of the episodes in which the robot stopped elsewhere."""
    timeouts: float
    time_s: float
    distance_to_goal_m: float
    """At the end, truly."""
    believed_distance_to_goal_m: float
    position_error_m: float
    lost: float
    """Share of the steps without a pose to act upon."""
    price_of_estimation: float
    """SPL under the true pose minus SPL under this estimator, in the same episodes."""
    price_low: float
    price_high: float


def score(episodes: Sequence[Episode], baseline: Sequence[Episode]) -> Score:
    """Score the episodes of one driver under one estimator.

    Args:
        episodes: of different seeds.
        baseline: the same driver's, of the same seeds, under the true pose.

    Raises:
        ValueError: there are none, or their seeds are not those of the baseline.
    """
    why = (
        "the price of estimation is paired: every episode needs one of the same seed under "
        f"{BASELINE}"
    )
    mine, truths = _paired(episodes, baseline, why)
    spl, success = _values(mine, "spl"), _values(mine, "success")
    spl_low, spl_high = interval(spl)
    success_low, success_high = interval(success)
    price = _values(truths, "spl") - spl
    price_low, price_high = interval(price)
    return Score(
        policy=mine[0].policy,
        estimator=mine[0].estimator,
        pose_latency=mine[0].pose_latency,
        episodes=len(mine),
        success=float(success.mean()),
        success_low=success_low,
        success_high=success_high,
        spl=float(spl.mean()),
        spl_low=spl_low,
        spl_high=spl_high,
        collisions=float(_values(mine, "collision").mean()),
        missed=float(np.mean([e.outcome == MISSED for e in mine])),
        timeouts=float(np.mean([e.outcome == TIMEOUT for e in mine])),
        price_of_estimation=float(price.mean()),
        price_low=price_low,
        price_high=price_high,
        **{name: float(_values(mine, name).mean()) for name in _MEANS},
    )


_MEANS = (
    "soft_spl",
    "time_s",
    "distance_to_goal_m",
    "believed_distance_to_goal_m",
    "position_error_m",
    "lost",
)


def interval(values: Array) -> tuple[float, float]:
    """The 95 % percentile bootstrap interval of the mean of values (n,).

    Every call resamples by the same indices for the same n: differences of paired values and the
    values themselves are resampled alike.
    """
    rng = np.random.default_rng(0)
    chosen = rng.integers(len(values), size=(_RESAMPLES, len(values)))
    tail = (1 - _CONFIDENCE) / 2
    low, high = np.quantile(values[chosen].mean(axis=1), [tail, 1 - tail])
    return float(low), float(high)


@dataclass(frozen=True, slots=True)
class Contrast:
    """What a driver gains over another one, under the same estimator in the same episodes."""

    policy: str
    against: str
    """The other driver."""
    estimator: str
    pose_latency: float
    spl_gain: float
    """SPL of the driver minus SPL of the other one; `_low` and `_high` hold 95 % of resamples."""
    spl_gain_low: float
    spl_gain_high: float
    success_gain: float
    """The same of success."""
    success_gain_low: float
    success_gain_high: float


def contrast(episodes: Sequence[Episode], others: Sequence[Episode]) -> Contrast:
    """Compare two drivers.

    Args:
        episodes: of one driver, of different seeds.
        others: of the other driver, of the same seeds.

    Raises:
        ValueError: there are none, or their seeds differ.
    """
    mine, theirs = _paired(episodes, others, "drivers are compared in the same episodes")
    spl, success = (_values(mine, name) - _values(theirs, name) for name in ("spl", "success"))
    spl_low, spl_high = interval(spl)
    success_low, success_high = interval(success)
    return Contrast(
        policy=mine[0].policy,
        against=theirs[0].policy,
        estimator=mine[0].estimator,
        pose_latency=mine[0].pose_latency,
        spl_gain=float(spl.mean()),
        spl_gain_low=spl_low,
        spl_gain_high=spl_high,
        success_gain=float(success.mean()),
        success_gain_low=success_low,
        success_gain_high=success_high,
    )


@dataclass(frozen=True, slots=True)
class Gap:
    """How well estimators' order by error on a replayed drive tells that by SPL in the loop."""

    policy: str
    by_ate: tuple[str, ...]
    """Estimators, the smallest error first."""
    by_spl: tuple[str, ...]
    """Estimators, the highest SPL first."""
    kendall_tau: float | None
    """Kendall's tau-b between the two: 1 the same order, -1 the reverse; None where all are equal
    in one of them."""
    p_value: float | None
    pose_latency: float = 0.0
    """s"""


def open_closed_gap(
    policy: str,
    ate: Mapping[str, float],
    spl: Mapping[str, float],
    *,
    pose_latency: float = 0.0,
) -> Gap:
    """Rank estimators both ways.

    Args:
        policy: whose loop it is.
        ate: absolute trajectory error by estimator, m.
        spl: in the loop.
        pose_latency: how late estimates arrived, s.

    Raises:
        ValueError: fewer than two estimators, or not the same ones.
    """
    names = sorted(ate)
    if len(names) < 2 or names != sorted(spl):
        raise ValueError(
            "to rank estimators takes two or more, each with an ATE and an SPL; got "
            f"{names} and {sorted(spl)}"
        )
    found = stats.kendalltau([-ate[name] for name in names], [spl[name] for name in names])
    tied = not np.isfinite(found.statistic)
    return Gap(
        policy,
        tuple(sorted(names, key=lambda name: ate[name])),
        tuple(sorted(names, key=lambda name: -spl[name])),
        None if tied else float(found.statistic),
        None if tied else float(found.pvalue),
        pose_latency,
    )


def _paired(
    episodes: Sequence[Episode], others: Sequence[Episode], why: str
) -> tuple[list[Episode], list[Episode]]:
    """Both by seed; an error that says why, where their seeds differ or there are none."""
    mine, theirs = (sorted(each, key=lambda e: e.seed) for each in (episodes, others))
    seeds, other_seeds = ([e.seed for e in each] for each in (mine, theirs))
    if not seeds or seeds != other_seeds:
        raise ValueError(f"{why}; got seeds {seeds} and {other_seeds}")
    return mine, theirs


def _values(episodes: Sequence[Episode], name: str) -> Array:
    return np.array([float(getattr(episode, name)) for episode in episodes])
