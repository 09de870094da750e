"""Frozen arrays: nobody may write to a value of them, nor to what is copied or unpickled of it."""

from dataclasses import fields
from typing import Any

import numpy as np


def freeze(owner: Any) -> None:
    """Make the arrays of a dataclass read-only."""
    for value in _values(owner):
        if isinstance(value, np.ndarray):
            value.setflags(write=False)


def rebuilt(owner: Any) -> tuple[Any, ...]:
    """Pickle and copy by construction: NumPy's own pickles would come back writeable."""
    return type(owner), _values(owner)


def _values(owner: Any) -> tuple[Any, ...]:
    return tuple(getattr(owner, f.name) for f in fields(owner))
