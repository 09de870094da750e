"""How kernels are compiled: exactly, without the lock, and with words where they cannot be kept."""

import math
from typing import Any

import numpy as np
import pytest

from grouser.kernels import kernel


@kernel
def _left_to_right(terms: Any) -> float:
    total = 0.0
    for k in range(terms.shape[0]):
        total += terms[k]
    return total


@kernel
def _ratio(a: float, b: float) -> float:
    return a / b


def test_sums_keep_their_order() -> None:
    """`fastmath` would add in lanes, and lose or keep other digits."""
    terms = np.array([1e16, 1.0, -1e16, 1.0] * 64)
    expected = 0.0
    for term in terms.tolist():
        expected += term
    assert _left_to_right(terms) == expected != math.fsum(terms)


def test_division_by_zero_is_as_in_numpy() -> None:
    assert _ratio(1.0, 0.0) == math.inf


def test_where_nothing_can_be_cached_the_error_says_what_to_set() -> None:
    found: dict[str, Any] = {}
    exec(compile("def orphan(): return 1", "/nowhere/orphan.py", "exec"), found)
    with pytest.raises(RuntimeError, match=r"'orphan'.*set NUMBA_CACHE_DIR to a folder that can"):
        kernel(found["orphan"])
