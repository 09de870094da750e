"""Wheel ticks and scans of a small robot, a row a scan: column numbers as in the file, from 0.

0        time, microseconds
2, 3     ticks of the left and the right wheel since the start
24-705   ranges of a Hokuyo URG-04LX, mm; 0 where nothing came back

Other columns are passed over. The robot is that of the file `exp1.dat` that comes with BreezySLAM,
whose mines.py has its measures. There, degrees are ticks * 180 / 2000, but the way is the sum of
both wheels' and not their mean: a turn of a wheel is 2000 ticks after all, as the scans confirm
(they turn and move 1.9 times as far as half of it would).
"""

from math import pi, radians
from pathlib import Path

import numpy as np

from grouser.envs.recordings.lidar_log import LidarLog, growing_stamps
from grouser.geometry import transform
from grouser.rig import Lidar, Rig, TrackGeometry
from grouser.text_table import read_rows

COLUMNS = 707
_FIRST_RANGE, _N_RANGES = 24, 682
_DROPPED = 70  # beams at each end, which see the robot

_TICKS_PER_TURN, _WHEEL_RADIUS, _HALF_AXLE = 2000, 0.077, 0.165  # 1, m, m
_WHEEL_WIDTH = 0.03  # m; not recorded
_LIDAR_AHEAD = 0.145  # m ahead of the axle

# Of the lidar's data sheet: 1024 beams a turn, ahead is the 384th, the first recorded the 44th.
_BEAM, _AHEAD = radians(360 / 1024), 384 - 44
_RANGE_MAX = 4.0  # m
_N_BEAMS = _N_RANGES - 2 * _DROPPED


def open_ticks(path: str | Path) -> LidarLog:
    """Read such a file; observations are `tracks` and `lidar`.

    Raises:
        FileNotFoundError: there is no such file.
        ValueError: a row that is no such row, with file and line, or a single row.
    """
    rows, lines = read_rows(path, COLUMNS)
    if len(rows) < 2:
        raise ValueError(f"{path}:{lines[0]}: the file ends after one scan; a recording needs two")
    ranges = rows[:, _FIRST_RANGE : _FIRST_RANGE + _N_RANGES]
    for row, line in zip(ranges, lines, strict=True):
        if (row < 0).any():
            column = _FIRST_RANGE + int(np.argmin(row))
            raise ValueError(f"{path}:{line}: the range in column {column} is negative")
    stamps, dt = growing_stamps(rows[:, 0] * 1e-6)
    scans = 1e-3 * ranges[:, _DROPPED:-_DROPPED]
    scans[scans == 0] = np.inf
    tracks = np.zeros((len(rows), 2))
    tracks[1:] = np.diff(rows[:, 2:4], axis=0) * (2 * pi / _TICKS_PER_TURN) * _WHEEL_RADIUS
    return LidarLog(_rig(dt), stamps, scans.astype(np.float32), {"tracks": tracks}, None)


def _rig(dt: float) -> Rig:
    return Rig(
        dt=dt,
        tracks=TrackGeometry(
            gauge=2 * _HALF_AXLE, width=_WHEEL_WIDTH, effective_width=2 * _HALF_AXLE
        ),
        lidar=Lidar(
            n_beams=_N_BEAMS,
            angle_min=(_DROPPED - _AHEAD) * _BEAM,
            angle_increment=_BEAM,
            range_min=0.06,
            range_max=_RANGE_MAX,
            sigma_range=0.03,
            sigma_bearing=0.0015,
            T_base_lidar=transform(np.eye(3), [_LIDAR_AHEAD, 0.0, 0.0]),
        ),
    )
