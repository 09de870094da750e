"""What tests of several rooms share."""

import os
from pathlib import Path

import pytest


@pytest.fixture(scope="session")
def kitti_06() -> Path:
    """51 frames of KITTI odometry 06, which are not ours to ship."""
    data = Path(os.environ.get("GROUSER_DATA", Path(__file__).parents[2] / "shared/data"))
    folder = data / "kitti_06_first51"
    if not folder.is_dir():
        pytest.skip(f"no recording at {folder}; set GROUSER_DATA to its parent")
    return folder
