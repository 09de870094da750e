"""What `grouser compare` must show on real stereo images; the times are for the benchmark."""

import json
from pathlib import Path

import pytest

from grouser.scripts.cli import main


def test_one_point_on_kitti_06(tmp_path: Path, kitti_06: Path) -> None:
    names = ["one-point-ransac", "five-point-ransac"]
    options = ["--estimators", *names, "--no-plots", "--output", str(tmp_path / "a")]
    assert main(["compare", "--log", str(kitti_06), *options]) == 0
    one_point, five_point = json.loads((tmp_path / "a/results.json").read_text())
    assert one_point["distance_m"] == pytest.approx(59.8, abs=0.1)
    assert one_point["drift_percent"] <= 1.0
    assert one_point["drift_deg_per_m"] <= 0.02
    assert one_point["drift_percent_3d"] <= 1.0
    assert one_point["drift_deg_per_m_3d"] <= 0.02
    assert one_point["tracking_fraction"] == 1
    assert five_point["lost_fraction"] == 0
