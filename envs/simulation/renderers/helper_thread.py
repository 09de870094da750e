"""One more thread to work in, made at its first use and never carried through a fork."""

import os
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from typing import TypeVar

T = TypeVar("T")


class HelperThread:
    """Runs calls that release Python's lock beside the caller's own.

    A thread does not survive a fork, but an executor that a child inherits would still wait for
    it; so the thread belongs to the process that made it, and a child makes its own.
    """

    def __init__(self) -> None:
        self._executor: ThreadPoolExecutor | None = None
        self._owner = -1

    def submit(self, call: Callable[[], T]) -> "Future[T]":
        """Start a call; `result()` of what is returned waits for it."""
        if self._executor is None or self._owner != os.getpid():
            self._executor = ThreadPoolExecutor(1, thread_name_prefix="grouser")
            self._owner = os.getpid()
        return self._executor.submit(call)

    def close(self) -> None:
        """End the thread; a second call does nothing, a later `submit` makes a new one."""
        if self._executor is not None and self._owner == os.getpid():
            self._executor.shutdown(wait=True)
        self._executor = None
