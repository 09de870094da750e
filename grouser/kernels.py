"""How numba kernels are compiled: IEEE-exact, without Python's lock, cached on disk.

`fastmath` stays off, so that the same seed gives the same bits on every processor. numba notices a
changed file by its date, and only the kernel's own: a kernel that calls kernels of other files says
so (`kernel_using`), or a stale copy of them would be used after they changed.
"""

import logging
from collections.abc import Callable
from functools import cache
from pathlib import Path
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


def kernel_using(*kernels: Any) -> Decorator:
    """Decorator of a kernel that calls these kernels of other files: compiled anew when one of
    their files (or of the files that those call) has changed since."""
    if numba.config.DISABLE_JIT:
        return kernel  # nothing is compiled, so nothing can be stale
    sources = frozenset().union(*(_sources(called) for called in kernels))

    def decorate(function: Callable[..., Any]) -> Any:
        compiled = kernel(function)
        compiled.grouser_sources = sources
        _forget_older_than(compiled, max(source.stat().st_mtime for source in sources))
        return compiled

    return decorate


def _sources(called: Any) -> frozenset[Path]:
    """The file of a kernel, and those of the kernels that it says it calls."""
    own = Path(called.py_func.__code__.co_filename)
    return frozenset({own}) | getattr(called, "grouser_sources", frozenset())


def _forget_older_than(compiled: Any, changed: float) -> None:
    """Remove the index of a kernel's cache, without which numba compiles it again."""
    code = compiled.py_func.__code__
    stem = f"{Path(code.co_filename).stem}.{compiled.py_func.__qualname__}-{code.co_firstlineno}."
    for index in Path(compiled.stats.cache_path).glob("*.nbi"):
        if index.name.startswith(stem) and index.stat().st_mtime < changed:
            index.unlink(missing_ok=True)


@cache
def announce() -> None:
    """Say once a process, in the log, why the first step may take long."""
    logging.getLogger(__name__).info(
        "loading kernels; the first run ever compiles them, which takes up to a minute"
    )
