"""Small logs of a robot in a room, written as CARMEN's logger and the small robot do."""

from pathlib import Path

import numpy as np

from grouser.geometry import Array, compose, inverse, lift
from grouser.trajectory import Trajectory, write_tum

N, BEAMS = 12, 180
STEP = np.array([0.5, 0.0, 0.1])
"""Of the odometry."""
SEEN = np.array([0.48, 0.01, 0.12])
"""Of the truth."""
START = np.array([3.0, -1.0, 0.7])
LOW, HIGH = np.array([-6.0, -5.0]), np.array([9.0, 8.0])
"""m, corners of the room"""


def poses(step: Array, n: int = N) -> Array:
    """(n, 3) in any frame."""
    way = [START]
    for _ in range(n - 1):
        way.append(compose(way[-1], step))
    return np.array(way)


def ranges(pose: Array, bearings: Array) -> Array:
    """m to the walls of the room, from within."""
    heading = pose[2] + bearings
    direction = np.column_stack([np.cos(heading), np.sin(heading)])
    walls = np.where(direction > 0, HIGH, LOW)
    with np.errstate(divide="ignore"):
        return np.asarray(((walls - pose[:2]) / direction).min(axis=1))


def carmen_lines(n: int = N) -> list[str]:
    """The message PARAM, then FLASER and ODOM in turn; the fourth beam never comes back."""
    bearings = np.radians(np.arange(BEAMS) - 90.0)
    lines = ["# written for a test", "PARAM robot_frontlaser_offset 0.2 0 host 0"]
    truth = poses(SEEN, n)
    for k, odometry in enumerate(poses(STEP, n)):
        scan = ranges(compose(truth[k], [0.2, 0.0, 0.0]), bearings)
        scan[3] = 81.83
        pose = " ".join(f"{x:.6f}" for x in odometry)
        beams = " ".join(f"{x:.3f}" for x in scan)
        lines.append(f"FLASER {BEAMS} {beams} {pose} {pose} {10 + 2 * k}.5 host {10 + 2 * k}.6")
        lines.append(f"ODOM {pose} 0.5 0.0 0.0 {11 + 2 * k}.5 host {11 + 2 * k}.6")
    return lines


def write_carmen(folder: Path, lines: list[str] | None = None, *, reference: bool = True) -> Path:
    """room.log, and room_ref.tum beside it."""
    path = folder / "room.log"
    path.write_text("\n".join(carmen_lines() if lines is None else lines) + "\n")
    if reference:
        # In a frame of its own, as the maps of others are.
        elsewhere = compose(inverse([1.0, 2.0, 0.5]), poses(SEEN))
        stamps = np.arange(N, dtype=np.float64)
        write_tum(folder / "room_ref.tum", Trajectory(stamps, lift(elsewhere)))
    return path


def tick_rows(n: int = N) -> Array:
    """(n, 707): left wheel 100 ticks a scan, the right one 200; every beam sees 1.5 m, or not."""
    rows = np.zeros((n, 707))
    rows[:, 0] = 2e8 + 1e5 * np.arange(n)
    rows[:, 2], rows[:, 3] = 5000 + 100 * np.arange(n), -3000 + 200 * np.arange(n)
    rows[:, 24:706] = 1500
    rows[:, 24 + 100] = 0
    rows[:, 24 + 101] = 5500
    return rows


def write_ticks(folder: Path, rows: Array | None = None) -> Path:
    path = folder / "room.dat"
    np.savetxt(path, tick_rows() if rows is None else rows, fmt="%.0f")
    return path
