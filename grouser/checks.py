"""What is checked where a value is made, and the words that help where it is wrong."""

import difflib
from collections.abc import Collection
from numbers import Integral, Real

import numpy as np


def require_positive(owner: object, *names: str) -> None:
    """The owner's named attributes are numbers above zero, and finite; ValueError where not."""
    for name in names:
        value = getattr(owner, name)
        if not (isinstance(value, Real) and 0 < float(value) < np.inf):
            raise ValueError(f"{type(owner).__name__}.{name} must be positive, got {value!r}")


def require_whole(owner: object, *names: str) -> None:
    """They are whole numbers above zero."""
    for name in names:
        value = getattr(owner, name)
        if not (isinstance(value, Integral) and int(value) > 0):
            raise ValueError(
                f"{type(owner).__name__}.{name} must be a positive whole number, got {value!r}"
            )


def require_finite(owner: object, *names: str) -> None:
    """They are finite numbers."""
    for name in names:
        value = getattr(owner, name)
        if not np.isfinite(value):
            raise ValueError(f"{type(owner).__name__}.{name} must be finite, got {value!r}")


def require_not_negative(owner: object, *names: str) -> None:
    """They are finite numbers, or arrays of such, of zero or more."""
    for name in names:
        value = getattr(owner, name)
        if not np.all(np.isfinite(value) & (np.asarray(value) >= 0)):
            raise ValueError(f"{type(owner).__name__}.{name} must be zero or more, got {value!r}")


def require_positive_options(**values: float) -> None:
    """Keyword arguments are finite numbers above zero; ValueError where not."""
    for name, value in values.items():
        if not (np.isfinite(value) and value > 0):
            raise ValueError(f"{name} must be positive and finite, got {value!r}")


def require_at_least(least: int, **counts: int) -> None:
    """Keyword arguments are whole numbers of at least so many."""
    for name, value in counts.items():
        if not isinstance(value, Integral) or value < least:
            raise ValueError(f"{name} must be a whole number of at least {least}, got {value!r}")


def did_you_mean(name: object, known: Collection[str]) -> str:
    """A question, with a space behind it, about the known name nearest to one that is not known;
    nothing where none is near."""
    near = difflib.get_close_matches(str(name), known, n=1)
    return f"did you mean {near[0]!r}? " if near else ""
