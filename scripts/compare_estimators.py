"""Which estimators take part in a comparison, and which sensors they need."""

from collections.abc import Iterable, Sequence

from grouser.estimators import registry
from grouser.estimators.base import TRUTH_KEYS, lacking

STANDARD = ("ground-truth", "dead-reckoning", "one-point-ransac", "five-point-ransac")
"""Those compared when none is named, as far as the source can feed them."""

STANDARD_BLIND = ("ground-truth", "dead-reckoning", "ekf-line-slam")
"""The same where there are no images."""


def choose(asked: Sequence[str], gives: frozenset[str], source: str) -> list[str]:
    """The names to compare, each once, in the order in which they were asked for.

    Raises:
        ValueError: an unknown name, or an estimator that needs what the source does not give.
    """
    if not asked:
        standard = STANDARD if {"left", "right"} <= gives else STANDARD_BLIND
        return [name for name in standard if not _lacks(name, gives)]
    for name in asked:
        lacks = _lacks(name, gives)
        if lacks:
            raise ValueError(
                f"estimator {name!r} needs {', '.join(lacks)}, which {source} does not give; "
                f"it gives {', '.join(sorted(gives))}: leave {name!r} out of --estimators"
            )
    return list(dict.fromkeys(asked))


def sensors_for(names: Iterable[str], gives: frozenset[str]) -> list[str]:
    """The sensors that these estimators read; what nobody reads is not even rendered."""
    return sorted((registry.keys_read(names) & gives) - TRUTH_KEYS - {"stamp"})


def _lacks(name: str, gives: frozenset[str]) -> list[str]:
    return lacking(registry.estimator_class(name), gives)
