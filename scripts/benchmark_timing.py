"""What all benchmarks measure with."""

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Figures = dict[str, tuple[float, str]]
"""Figure name to value and unit."""


class NotAvailable(Exception):
    """What this machine cannot measure, and why."""


@dataclass(frozen=True)
class Measurement:
    """A program that measures some figures together, as they share a run."""

    measure: Callable[[], Figures]
    gives: tuple[str, ...]
    """Names of the figures."""


def seconds(call: Callable[[], object]) -> float:
    """How long a call takes."""
    start = time.perf_counter()
    call()
    return time.perf_counter() - start


def median_seconds(call: Callable[[], object], n: int) -> float:
    """Median of n calls, after one that does not count."""
    call()
    return float(np.median([seconds(call) for _ in range(n)]))


def least_seconds(calls: Mapping[str, Callable[[], object]], n: int) -> dict[str, float]:
    """Shortest of n turns of each call, after one that does not count. They take turns, so that
    what slows the machine slows all, and of what a turn takes only what others add varies."""
    for call in calls.values():
        call()
    turns = [{name: seconds(call) for name, call in calls.items()} for _ in range(n)]
    return {name: min(turn[name] for turn in turns) for name in calls}


def curves() -> list[NDArray[np.float32]]:
    """Actions: curves to either side and a spot turn, within the place that is kept clear."""
    pairs = [(0.6, 0.4)] * 20 + [(0.4, 0.6)] * 20 + [(-0.5, 0.5)] * 10
    return [np.array(pair, np.float32) for pair in pairs]
