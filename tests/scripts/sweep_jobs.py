"""Runs for tests of sweeps, in a module of their own that other processes can import."""

import os
import signal
from pathlib import Path

import numpy as np


def draw(seed: int) -> bytes:
    """What a run with a seed gives."""
    return np.random.default_rng(seed).standard_normal(100).tobytes()


def kill_the_first_time(path: Path) -> str:
    """Kill the worker that does this first; done again, it works."""
    if not path.exists():
        path.touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return path.name


def kill(_: int) -> None:
    """Kill whoever does this."""
    os.kill(os.getpid(), signal.SIGKILL)


def refuse(number: int) -> int:
    """A run that cannot be done."""
    raise ValueError(f"run {number} cannot be done")
