"""How kernels are compiled: exactly, without the lock, and with words where they cannot be kept."""

import math
import os
import subprocess
import sys
import time
from pathlib import Path
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


CALLED = """
from grouser.kernels import kernel


@kernel
def price():
    return {value}
"""
CALLING = """
import called
from grouser.kernels import kernel, kernel_using

price = called.price


@kernel_using(called.price)
def twice():
    return 2 * price()


@kernel_using(twice)
def thrice_of_twice():
    return 3 * twice()
"""
ASKING = """
import calling
print(calling.twice(), calling.thrice_of_twice(), sum(calling.twice.stats.cache_hits.values()))
"""


def test_a_kernel_is_compiled_anew_when_one_that_it_uses_has_changed(tmp_path: Path) -> None:
    def ask() -> list[int]:
        done = subprocess.run(
            [sys.executable, "-c", ASKING],
            cwd=tmp_path,
            env={**os.environ, "PYTHONPATH": f"{tmp_path}:{Path(__file__).parents[2]}"},
            capture_output=True,
            text=True,
        )
        assert done.returncode == 0, done.stderr
        return [int(word) for word in done.stdout.split()]

    (tmp_path / "called.py").write_text(CALLED.format(value=7))
    (tmp_path / "calling.py").write_text(CALLING)
    assert ask() == [14, 42, 0]
    assert ask() == [14, 42, 1]  # from the cache
    time.sleep(0.05)
    (tmp_path / "called.py").write_text(CALLED.format(value=50))
    assert ask() == [100, 300, 0]
