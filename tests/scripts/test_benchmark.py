"""The benchmark measures what it says, writes what it measured and refuses what it cannot do."""

import json
from pathlib import Path

import pytest

from grouser.scripts.benchmark import Benchmark, measure


@pytest.mark.parametrize(
    ("name", "figures"),
    [
        ("odometry", {"odometry.pair_320x240_ms", "odometry.estimation_ms"}),
        ("environment.raster_over_naive", {"environment.raster_over_naive"}),
        ("environment.lidar_boxes_us", {"environment.lidar_boxes_us"}),
        ("slip.width_vision_frame", {"slip.width_vision_frame"}),
        (
            "line_slam",
            {
                "line_slam.bisection_over_points",
                "line_slam.closed_1e5_ms",
                "line_slam.extraction_360_ms",
                "line_slam.update_n1000_ms",
            },
        ),
    ],
)
def test_figures_go_to_json(name: str, figures: set[str], tmp_path: Path) -> None:
    output = tmp_path / "figures.json"
    assert Benchmark(only=name, output=output).run() == 0
    measured = json.loads(output.read_text())
    assert figures <= set(measured)
    for figure, entry in measured.items():
        assert figure == name or figure.startswith(f"{name}.")
        assert entry["value"] > 0 and isinstance(entry["unit"], str)


@pytest.mark.parametrize(
    ("benchmark", "words"),
    [
        (
            Benchmark(only="odometer"),
            "there is no figure 'odometer'; there are: odometry, environment, images, ",
        ),
        (Benchmark(output=Path("/nowhere/figures.json")), "there is no folder /nowhere; make it"),
    ],
)
def test_misuse_is_told_before_anything_is_measured(
    benchmark: Benchmark, words: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert benchmark.run() == 2
    assert words in capsys.readouterr().err


def test_every_measurement_gives_the_figures_it_names() -> None:
    wanted = ["environment.physics_us", "odometry.estimation_ms"]
    assert list(measure(wanted)) == wanted
