"""Recorded drives of a skid-steered robot, and how much less it turned than its wheels said."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from grouser.geometry import Array
from grouser.text_table import read_rows

DT = 0.1
"""Between two rows, s."""

_COLUMNS = 8
_WINDOW = 50
"""Rows over which turned and driven ways are compared. The median over windows keeps out the start,
where the robot gets going. (The positions are smoothed over some 25 rows. So are the headings, and
across their jump of 2 pi too, which spoils them: the course over ground is used instead.)"""


@dataclass(frozen=True)
class Run:
    """One drive: where the robot was, and what its wheels said."""

    name: str
    position: Array
    """(n, 2) m"""
    speed: Array
    """(n,) forward, from the wheels, m/s."""
    yaw_rate: Array
    """(n,) from the wheels and the distance between them, rad/s."""


def read_runs(folder: Path) -> list[Run]:
    """The drives run*.csv of a folder: rows of X Y theta u1 u2 and three that are not used.

    Raises:
        FileNotFoundError: there is no such folder, or no drive in it.
        ValueError: a row is malformed, or a drive too short to tell anything.
    """
    if not folder.is_dir():
        raise FileNotFoundError(f"{folder} is no folder; --data names the one that holds run*.csv")
    paths = sorted(folder.glob("run*.csv"))
    if not paths:
        raise FileNotFoundError(f"{folder} holds no run*.csv (rows of X Y theta u1 u2 ...)")
    return [_read(path) for path in paths]


def _read(path: Path) -> Run:
    rows, _ = read_rows(path, _COLUMNS)
    if len(rows) < 2 * _WINDOW:
        raise ValueError(f"{path} has {len(rows)} rows; at least {2 * _WINDOW} are needed")
    return Run(path.stem, rows[:, :2], rows[:, 3], rows[:, 4])


def course(position: Array) -> Array:
    """(n - 1,) direction in which positions (n, 2) go on, rad, without jumps."""
    step = np.diff(position, axis=0)
    return np.asarray(np.unwrap(np.arctan2(step[:, 1], step[:, 0])))


def yaw_efficiency(position: Array, yaw_rate: Array) -> float:
    """How far the course turned, over how far the wheels' yaw rate (n,) says it did.

    The median over windows of 5 s.
    """
    return _median_ratio(course(position), yaw_rate)


def speed_ratio(position: Array, speed: Array) -> float:
    """How far the robot came, over how far its wheels' speed (n,) says it did, likewise."""
    step = np.linalg.norm(np.diff(position, axis=0), axis=1)
    return _median_ratio(np.append(0.0, np.cumsum(step)), speed)


def _median_ratio(done: Array, rate: Array) -> float:
    """The gain of `done` over the integral of a rate."""
    starts = np.arange(0, len(done) - _WINDOW, _WINDOW)
    gained = done[starts + _WINDOW] - done[starts]
    said = DT * np.array([np.sum(rate[start : start + _WINDOW]) for start in starts])
    return float(np.median(gained / said))
