"""Which estimators take part: the paper's method in two forms, and every registered rival."""

from collections.abc import Sequence

from grouser.envs.sensors.suite import SENSORS
from grouser.estimators import registry

RECOMMENDED = "one-point-ransac"
"""The paper's method as SPEC 1.5 recommends it: keyframes, tracks, scale states."""
PAPER_FORM = "one-point-paper"
"""The paper's method as the paper has it."""

_NOT_OF_THIS_PAPER = frozenset({"lidar"})
"""Sensors of other methods: the paper's robot has a pair of eyes and tracks."""
_LINES = "lines"
"""An estimator that reads these sees by them, or by the lidar in their place: by neither, none."""


def contenders(asked: Sequence[str] = ()) -> tuple[str, ...]:
    """The names that take part, the paper's method first: those asked for, or all that there are.

    Raises:
        ValueError: an unknown name, or one that needs what the simulated robot does not have; or
            the paper's method is not among them.
    """
    if not asked:
        rivals = [name for name in registry.names() if name not in registry.TRUTH_READERS]
        return _ordered([name for name in rivals if _is_rival(name)])
    for name in asked:
        kind = registry.estimator_class(name)
        lacking = sorted((kind.requires | (kind.optional & {_LINES})) - _given())
        if lacking:
            raise ValueError(
                f"estimator {name!r} needs {', '.join(lacking)}, which the robot of this paper "
                f"does not give; leave it out of --estimators"
            )
    if RECOMMENDED not in asked:
        raise ValueError(
            f"the paper's method, {RECOMMENDED!r}, is not among --estimators {' '.join(asked)}; "
            "the page is about it: add it"
        )
    return _ordered(list(dict.fromkeys(asked)))


def forms(names: Sequence[str]) -> tuple[str, ...]:
    """Those of the names that are the paper's method."""
    return tuple(name for name in (RECOMMENDED, PAPER_FORM) if name in names)


def sensors_for(names: Sequence[str]) -> tuple[str, ...]:
    """The sensors that these estimators read."""
    return tuple(sorted(registry.keys_read(names) & (_given() - {"stamp"})))


def _ordered(names: list[str]) -> tuple[str, ...]:
    first = forms(names)
    return first + tuple(name for name in names if name not in first)


def _is_rival(name: str) -> bool:
    kind = registry.estimator_class(name)
    return kind.requires <= _given() and _LINES not in kind.optional


def _given() -> frozenset[str]:
    return (frozenset(SENSORS) - _NOT_OF_THIS_PAPER) | {"stamp"}
