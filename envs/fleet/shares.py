"""Who gets which processors, and which environments.

A step lasts a few milliseconds or less, which is short for a scheduler: left alone, it often keeps
two busy workers on one processor and leaves another idle. So the processors are dealt out.
"""

import os
from collections.abc import Iterator
from contextlib import contextmanager


def n_crews(num_envs: int) -> int:
    """How many processes step so many environments: no more than there are processors."""
    return max(1, min(num_envs, n_processors()))


def n_processors() -> int:
    """How many this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1  # macOS, Windows


def processors(index: int, of: int) -> frozenset[int]:
    """Those of this process's processors that one of so many crews gets: a fair share, or one of
    them where there are more crews; none where the system does not let processes choose."""
    if not hasattr(os, "sched_getaffinity"):  # macOS, Windows
        return frozenset()
    own = sorted(os.sched_getaffinity(0))
    if of >= len(own):
        return frozenset({own[index % len(own)]})
    return frozenset(own[index * len(own) // of : (index + 1) * len(own) // of])


def environments(index: int, of: int, num_envs: int) -> range:
    """Those that one of so many crews steps: a fair share of neighbours."""
    return range(index * num_envs // of, (index + 1) * num_envs // of)


@contextmanager
def keeping_to(share: frozenset[int]) -> Iterator[None]:
    """Run the calling thread on these processors alone, then on all that it had before; on none in
    particular where the share is empty."""
    if not share:
        yield
        return
    before = os.sched_getaffinity(0)
    os.sched_setaffinity(0, share)
    try:
        yield
    finally:
        os.sched_setaffinity(0, before)
