"""Ranges of the numbers that frozen values hold, checked where they are made."""

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
