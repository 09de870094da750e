"""CARMEN logs, one message a line: the front lidar's scans with the odometry, in their order.

FLASER n r_1 ... r_n x y theta odom_x odom_y odom_theta stamp host logger_stamp
ODOM x y theta speed turn_rate acceleration stamp host logger_stamp
PARAM name value stamp host logger_stamp

Of PARAM, robot_frontlaser_offset (how far the lidar is ahead [m]) and robot_front_laser_max (a
reading of so much or more is no return [m]) count. Other messages are passed over. Reference poses
by the scans' numbers, where they are known, stand beside NAME.log as NAME_ref.tum.
"""

import re
from dataclasses import dataclass, field
from math import pi
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from grouser.checks import did_you_mean
from grouser.envs.recordings.lidar_log import LidarLog, growing_stamps
from grouser.geometry import Array, between, project, transform
from grouser.rig import Lidar, Rig
from grouser.rig_motion import Odometry
from grouser.text_table import parse_row, read_text
from grouser.trajectory import read_tum

_READ = ("FLASER", "ODOM", "PARAM")
_PASSED_OVER = re.compile(
    r"RLASER|SYNC|TRUEPOS|GLOBALPOS|(ROBOT|RAW|POSITION_?)?LASER\d|NMEA\w+|GPS\w*|IMU|SONAR|BUMPER|"
    r"PANTILT|MARKER|COMMENT|VERSION"
)
_LASER_MAX, _LASER_OFFSET = "robot_front_laser_max", "robot_frontlaser_offset"

_NO_RETURN = 80.0  # m; no lidar of these logs sees so far
_HALF_TURN = pi
_SIGMA_RANGE, _SIGMA_BEARING = 0.02, 0.0015  # m, rad (SPEC 2.6)
_RANGE_MIN = 0.05  # m
_OFTEN = 10  # readings


@dataclass(slots=True)
class _Read:
    """What was read so far."""

    ranges: list[list[float]] = field(default_factory=list)
    odometry: list[list[float]] = field(default_factory=list)
    stamps: list[float] = field(default_factory=list)
    parameters: dict[str, float] = field(default_factory=dict)


def open_carmen(path: str | Path) -> LidarLog:
    """Read a log; observations are `lidar` and `odometry`.

    Scans follow each other as their lines do: a stamp that runs backwards is a clock that was set.

    Raises:
        FileNotFoundError: there is no such file.
        ValueError: a broken line, named with file and number; fewer than two scans; reference
            poses that are malformed, or not one a scan.
    """
    path = Path(path)
    read = _Read()
    lines = read_text(path).splitlines()
    for number, line in enumerate(lines, start=1):
        words = line.split()
        if words and not words[0].startswith("#"):
            _take(read, words, f"{path}:{number}")
    if len(read.ranges) < 2:
        raise ValueError(
            f"{path}:{len(lines)}: the log ends after {len(read.ranges)} FLASER scans; a recording "
            "needs two at least (scans of other messages, such as ROBOTLASER1, are not read)"
        )
    stamps, dt = growing_stamps(np.array(read.stamps))
    scans, range_max = _returns(np.array(read.ranges), read.parameters)
    poses = np.array(read.odometry)
    odometry = np.zeros((len(poses), 3))
    odometry[1:] = between(poses[:-1], poses[1:])
    lidar = _lidar(scans.shape[1], range_max, read.parameters.get(_LASER_OFFSET, 0.0))
    rig = Rig(dt=dt, lidar=lidar, odometry=Odometry())
    reference = _reference(path, len(scans))
    return LidarLog(rig, stamps, scans, {"odometry": odometry}, reference)


def _take(read: _Read, words: list[str], place: str) -> None:
    match words[0]:
        case "FLASER":
            _take_scan(read, words[1:], place)
        case "ODOM":
            _check_count("ODOM", words, 10, place)
            parse_row([*words[1:8], words[9]], (8,), f"{place}: ODOM")
        case "PARAM" if len(words) > 1 and words[1] in (_LASER_MAX, _LASER_OFFSET):
            (read.parameters[words[1]],) = parse_row(words[2:3], (1,), f"{place}: PARAM {words[1]}")
        case "PARAM":
            pass
        case name if not _PASSED_OVER.fullmatch(name):
            raise ValueError(
                f"{place}: {name[:40]!r} is no message of a CARMEN log; "
                f"{did_you_mean(name, _READ)}a line begins with FLASER, ODOM, PARAM or another "
                "message's name"
            )


def _take_scan(read: _Read, words: list[str], place: str) -> None:
    (count,) = parse_row(words[:1], (1,), f"{place}: number of readings of FLASER")
    n = len(read.ranges[0]) if read.ranges else int(count)
    if count != n or n < 2:
        allowed = "a whole number above 1" if not read.ranges else f"{n}, as in the first scan"
        raise ValueError(f"{place}: FLASER of {count:g} readings; expected {allowed}")
    _check_count("FLASER", ["", *words], n + 11, place)
    numbers = parse_row([*words[1 : n + 8], words[n + 9]], (n + 8,), f"{place}: FLASER")
    if min(numbers[:n]) < 0:
        raise ValueError(f"{place}: FLASER reads a negative range, {min(numbers[:n]):g} m")
    read.ranges.append(numbers[:n])
    read.odometry.append(numbers[n + 3 : n + 6])
    read.stamps.append(numbers[n + 6])


def _check_count(name: str, words: list[str], expected: int, place: str) -> None:
    if len(words) != expected:
        raise ValueError(
            f"{place}: {name} is a line of {expected} words here, found {len(words)}: is it cut "
            "short, or two lines in one?"
        )


def _returns(ranges: Array, parameters: dict[str, float]) -> tuple[NDArray[np.float32], float]:
    """Scans with infinity where nothing came back, and the least range that means so."""
    limit = min(_NO_RETURN, parameters.get(_LASER_MAX, _NO_RETURN))
    top = float(ranges[ranges < limit].max(initial=0.0))
    # Some lidars were told to end nearer: they say that very range more often than any near it.
    near = np.count_nonzero((ranges >= 0.9 * top) & (ranges < top))
    if np.count_nonzero(ranges == top) > max(int(near), _OFTEN):
        limit = top
    scans = np.where(ranges >= limit, np.inf, ranges).astype(np.float32)
    return scans, limit


def _lidar(n_beams: int, range_max: float, ahead: float) -> Lidar:
    """Of half a turn, as CARMEN takes it: 180 and 360 beams leave out the last, 181 and 361 not."""
    return Lidar(
        n_beams=n_beams,
        angle_min=-_HALF_TURN / 2,
        angle_increment=_HALF_TURN / (n_beams - n_beams % 2),
        range_min=_RANGE_MIN,
        range_max=range_max,
        sigma_range=_SIGMA_RANGE,
        sigma_bearing=_SIGMA_BEARING,
        T_base_lidar=transform(np.eye(3), [ahead, 0.0, 0.0]),
    )


def _reference(path: Path, scans: int) -> Array | None:
    """(N, 3) poses of NAME_ref.tum, whose first column is the number of the scan."""
    beside = path.with_name(f"{path.stem}_ref.tum")
    if not beside.exists():
        return None
    reference = read_tum(beside)
    if not np.array_equal(reference.stamps, np.arange(scans)):
        raise ValueError(
            f"{beside}: its first column must be the number of the scan, 0 to {scans - 1}, one row "
            f"each, as {path} holds {scans} scans; found {len(reference.stamps)} rows from "
            f"{reference.stamps[0]:g} to {reference.stamps[-1]:g}"
        )
    return project(reference.poses)
