"""`grouser calibrate disparity`: simulated offsets to a tenth of a pixel; misuse in words."""

import json
from pathlib import Path

import pytest

from grouser.scripts.cli import main

WORLD = ["calibrate", "disparity", "--world", "yard", "--steps", "90", "--driver", "straight"]


@pytest.mark.parametrize(("offset", "odometry"), [(0.1, "tracks"), (-0.8, "reference")])
def test_an_offset_is_found_to_a_tenth_of_a_pixel(
    offset: float, odometry: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Reduced: nine seconds of driving."""
    path = tmp_path / "offset.json"
    given = [*WORLD, "--offset-px", str(offset), "--odometry", odometry, "--output", str(path)]
    assert main(given) == 0
    found = json.loads(path.read_text())
    assert found["offset"]["offset"] == pytest.approx(offset, abs=0.1)
    assert found["structure"]["offset"] == pytest.approx(offset, abs=0.1)
    assert abs(found["odometry"]["offset"] - offset) < 3 * found["odometry"]["sigma"]
    assert found["distance"] is None
    printed = capsys.readouterr().out
    assert f"--disparity-offset-px {found['offset']['offset']:.3f}" in printed
    assert "the points alone" in printed and "beware" not in printed


def test_on_kitti_points_and_reference_agree(kitti_06: Path, tmp_path: Path) -> None:
    path = tmp_path / "offset.json"
    assert main(["calibrate", "disparity", "--log", str(kitti_06), "--output", str(path)]) == 0
    found = json.loads(path.read_text())
    assert -0.3 < found["structure"]["offset"] < -0.05
    assert -0.3 < found["odometry"]["offset"] < 0.05


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ([], "give one of --log (a recording) and --world (a simulated drive)"),
        (["--world", "yard", "--log", "x"], "give one of --log (a recording) and --world"),
        (["--log", "x", "--offset-px", "1"], "--offset-px is of a simulated drive and excludes"),
        (["--log", "nowhere"], "nowhere is missing or is not a folder"),
        (["--world", "moon"], "moon"),
        (["--world", "yard", "--camera-x", "1"], "--camera-... needs --log; a world knows its"),
        (["--world", "yard", "--offset-px", "9"], "must be a number from -8 to 8 (px), got 9"),
        (["--world", "yard", "--driver", "drunk"], "there is no driver 'drunk'; there are: stra"),
        (["--world", "yard", "--odometry", "gps"], "'gps' is not to be had here; there is: tracks"),
        (["--world", "yard", "--odometry-sigma", "2"], "is a share from 0 to 1 of an odometry"),
        (["--world", "yard", "--steps", "0"], "--steps must be at least 1, got 0"),
        (["--world", "yard", "--distance", "-1"], "--distance-sigma must be positive, got -1"),
        (["--world", "yard", "--distance-sigma", "1"], "no effect without --distance"),
        (["--world", "yard", "--output", "no/such/f.json"], "there is no folder for it"),
        (
            ["--world", "yard", "--driver", "spot-turn", "--steps", "12"],
            "nothing on this drive tells of the disparity offset: it takes a few metres",
        ),
    ],
)
def test_misuse_is_refused_in_words(
    arguments: list[str], words: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["calibrate", "disparity", *arguments]) == 2
    said = capsys.readouterr().err
    assert said.startswith("grouser calibrate: error: ") and words in said
