"""What `grouser compare` must show on real stereo images; the times are for the benchmark."""

import json
import os
from pathlib import Path

import pytest

from grouser.scripts.cli import main

DATA = Path(os.environ.get("GROUSER_DATA", Path(__file__).parents[3] / "shared/data"))
KITTI_06 = DATA / "kitti_06_first51"


@pytest.mark.skipif(
    not KITTI_06.is_dir(), reason=f"no recording at {KITTI_06}; set GROUSER_DATA to its parent"
)
def test_one_point_on_kitti_06(tmp_path: Path) -> None:
    names = ["one-point-ransac", "five-point-ransac"]
    options = ["--estimators", *names, "--no-plots", "--output", str(tmp_path / "a")]
    assert main(["compare", "--log", str(KITTI_06), *options]) == 0
    one_point, five_point = json.loads((tmp_path / "a/results.json").read_text())
    assert one_point["distance_m"] == pytest.approx(59.8, abs=0.1)
    assert one_point["drift_percent"] <= 1.0
    assert one_point["drift_deg_per_m"] <= 0.02
    assert one_point["drift_percent_3d"] <= 1.0
    assert one_point["drift_deg_per_m_3d"] <= 0.02
    assert one_point["tracking_fraction"] == 1
    assert five_point["lost_fraction"] == 0
