"""Where Mesa's software driver draws: its threads, each kept on a processor of its own."""

import os
from contextlib import suppress
from pathlib import Path

_TASKS = Path("/proc/self/task")


def threads() -> frozenset[int]:
    """The ids of this process's threads; none where they are not to be known."""
    if not hasattr(os, "sched_setaffinity") or not _TASKS.is_dir():
        return frozenset()
    return frozenset(int(task.name) for task in _TASKS.iterdir())


def spread(started: frozenset[int]) -> None:
    """Keep threads apart that were started one after another.

    The driver wakes all of its threads at once and sleeps. Linux then often puts two on one
    processor and leaves another idle for the few milliseconds that a picture takes: half of the
    pictures took 5.2 ms instead of 3.5.
    """
    if not started:
        return
    processors = sorted(os.sched_getaffinity(0))
    for number, thread in enumerate(sorted(started)):
        with suppress(ProcessLookupError):  # it has ended meanwhile
            os.sched_setaffinity(thread, {processors[number % len(processors)]})
