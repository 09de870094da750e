"""What a process does before it works for another: keep to its share, and end with its parent."""

import os
import threading
from multiprocessing import parent_process
from typing import Any

import cv2

from grouser.envs.fleet.shares import processors


def set_up_worker(started: Any, workers: int) -> None:
    """Give a new worker its share of the processors, and none of another's.

    Args:
        started: shared integer, the number of workers that have started.
        workers: how many there will be.
    """
    with started.get_lock():
        index, started.value = started.value, started.value + 1
    share = processors(index, workers)
    if share:
        os.sched_setaffinity(0, share)
    cv2.setNumThreads(1)
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    """A parent that was killed ends no worker by itself; this one would work on for nobody."""
    parent = parent_process()
    assert parent is not None
    parent.join()
    os._exit(1)
