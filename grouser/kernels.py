"""How numba kernels are compiled: IEEE-exact, without Python's lock, cached on disk.

`fastmath` stays off, so that the same seed gives the same bits on every processor. A kernel may
call only kernels of its own file: numba notices a changed file by its date and would go on using
a stale copy of what it had inlined from another one.
"""

import logging
from collections.abc import Callable
from functools import cache
from typing import Any

import numba

Decorator = Callable[[Callable[..., Any]], Any]


def _compiled(**options: Any) -> Decorator:
    """A decorator that compiles at the first call and caches on disk.

    Raises, when it decorates:
        RuntimeError: neither beside the source nor in the user's own cache may anything be written.
    """
    compiled = numba.njit(cache=True, nogil=True, fastmath=False, error_model="numpy", **options)

    def decorate(function: Callable[..., Any]) -> Any:
        try:
            return compiled(function)
        except RuntimeError as error:
            raise RuntimeError(
                f"{error}: neither its folder nor the user's cache can be written to; "
                "set NUMBA_CACHE_DIR to a folder that can"
            ) from error

    return decorate


kernel = _compiled()
"""Decorator: compiled at the first call and cached beside the source (or in NUMBA_CACHE_DIR)."""

inlined = _compiled(inline="always")
"""Decorator of a small function that becomes a part of the kernel that calls it."""


@cache
def announce() -> None:
    """Say once a process, in the log, why the first step may take long."""
    logging.getLogger(__name__).info(
        "loading kernels; the first run ever compiles them, which takes about half a minute"
    )
