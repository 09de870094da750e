"""How numba kernels are compiled: IEEE-exact, without Python's lock, cached on disk.

`fastmath` stays off, so that the same seed gives the same bits on every processor. A kernel may
call only kernels of its own file: numba notices a changed file by its date and would go on using
a stale copy of what it had inlined from another one.
"""

import logging
from functools import cache

import numba

kernel = numba.njit(cache=True, nogil=True, fastmath=False, error_model="numpy")
"""Decorator: compiled at the first call and cached beside the source (or in NUMBA_CACHE_DIR)."""

inlined = numba.njit(cache=True, nogil=True, fastmath=False, error_model="numpy", inline="always")
"""Decorator of a small function that becomes a part of the kernel that calls it."""


@cache
def announce() -> None:
    """Say once a process, in the log, why the first step may take long."""
    logging.getLogger(__name__).info(
        "loading kernels; the first run ever compiles them, which takes about half a minute"
    )
