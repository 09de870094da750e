"""What tests of several rooms share."""

import os
from pathlib import Path

import pytest


@pytest.fixture(scope="session")
def kitti_06() -> Path:
    """51 frames of KITTI odometry 06, which are not ours to ship."""
    return _recordings("kitti_06_first51")


@pytest.fixture(scope="session")
def carmen() -> Path:
    """Logs of lidar and odometry (intel, freiburg-101, aces), which are not ours to ship."""
    return _recordings("carmen")


@pytest.fixture(scope="session")
def exp1() -> Path:
    """Wheel ticks and scans of a small robot, which are not ours to ship."""
    return _recordings("ticks_and_lidar") / "exp1.dat"


def _recordings(name: str) -> Path:
    data = Path(os.environ.get("GROUSER_DATA", Path(__file__).parents[2] / "shared/data"))
    folder = data / name
    if not folder.is_dir():
        pytest.skip(f"no recording at {folder}; set GROUSER_DATA to its parent")
    return folder
