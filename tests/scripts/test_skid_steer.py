"""`grouser skid-steer` on drives whose answers are known, and on the real ones."""

import os
import re
from pathlib import Path

import numpy as np
import pytest

from grouser.geometry import Array
from grouser.scripts.cli import main
from grouser.scripts.skid_steer import SkidSteer
from grouser.scripts.skid_steer_runs import DT, Run, read_runs, speed_ratio, yaw_efficiency
from grouser.scripts.skid_steer_simulation import (
    GAUGE,
    TRACK,
    WHEELBASE,
    WHEELS,
    drive_again,
    with_lateral_factor,
)
from grouser.scripts.skid_steer_work import LATERAL_FACTORS, Variant, in_range, verdict


def turning(n: int, efficiency: float, slip: float = 0.0) -> tuple[Array, Array, Array]:
    """Positions (n, 2), speed and yaw rate of the wheels of a robot that drives a spiral."""
    speed, yaw_rate = np.linspace(0.5, 0.8, n), np.linspace(1.2, 0.6, n)
    heading = efficiency * DT * np.cumsum(yaw_rate)
    step = (1 - slip) * DT * speed[:, None] * np.column_stack([np.cos(heading), np.sin(heading)])
    return np.cumsum(step, axis=0), speed, yaw_rate


def write(path: Path, position: Array, speed: Array, yaw_rate: Array) -> None:
    """In the format of the recorded drives; the columns that nobody reads hold nonsense."""
    rows = np.column_stack([position, np.full(len(speed), 9.0), speed, yaw_rate])
    np.savetxt(path, np.column_stack([rows, np.full((len(speed), 3), -7.0)]), header="X Y theta ..")


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Two drives that turn at 0.38 and 0.42 of what their wheels say."""
    for k, efficiency in enumerate((0.38, 0.42)):
        write(tmp_path / f"run{k}.csv", *turning(160, efficiency))
    return tmp_path


@pytest.mark.parametrize("efficiency", [0.35, 0.8, 1.0])
def test_the_efficiency_is_how_far_the_course_turned(efficiency: float) -> None:
    position, speed, yaw_rate = turning(300, efficiency, slip=0.2)
    assert yaw_efficiency(position, yaw_rate) == pytest.approx(efficiency, rel=0.01)
    assert yaw_efficiency(position * [1, -1], -yaw_rate) == pytest.approx(efficiency, rel=0.01)
    assert speed_ratio(position, speed) == pytest.approx(0.8, rel=0.01)


def test_a_slow_start_does_not_count() -> None:
    position, _, yaw_rate = turning(300, 0.4)
    step = np.diff(position, axis=0)
    step[:40] = step[0]  # it goes straight first
    delayed = np.concatenate([[[0.0, 0.0]], np.cumsum(step, axis=0)])
    assert yaw_efficiency(delayed, yaw_rate) == pytest.approx(0.4, rel=0.02)


def test_drives_are_read_as_they_are_written(folder: Path) -> None:
    runs = read_runs(folder)
    position, speed, yaw_rate = turning(160, 0.42)
    assert [run.name for run in runs] == ["run0", "run1"]
    np.testing.assert_allclose(runs[1].position, position)
    np.testing.assert_allclose(runs[1].speed, speed)
    np.testing.assert_allclose(runs[1].yaw_rate, yaw_rate)


def test_a_robot_on_wheels_turns_as_much_as_coulomb_says() -> None:
    """b^2 / (a^2 + b^2) for half the gauge b and half the wheelbase a, whatever its speed."""
    position, speed, yaw_rate = turning(150, 1.0)
    run = Run("made-up", position, speed, yaw_rate)
    expected = GAUGE**2 / (GAUGE**2 + WHEELBASE**2)
    on_wheels = yaw_efficiency(drive_again(run, WHEELS, "asphalt"), yaw_rate)
    assert on_wheels == pytest.approx(expected, abs=0.03)
    stiffer = with_lateral_factor(WHEELS, 1.6)
    assert yaw_efficiency(drive_again(run, stiffer, "asphalt"), yaw_rate) == pytest.approx(
        GAUGE**2 / (GAUGE**2 + 1.6 * WHEELBASE**2), abs=0.03
    )
    on_tracks = yaw_efficiency(drive_again(run, TRACK, "asphalt"), yaw_rate)
    assert on_tracks > 1.3 * on_wheels


def test_the_verdict_names_the_factors_that_fit_and_says_where_none_does() -> None:
    real = np.array([0.36, 0.43])
    fits = Variant("wheels, gravel", WHEELS, "gravel", np.array([0.5, 0.45, 0.43, 0.4, 0.36, 0.3]))
    never = Variant("tracks, gravel", TRACK, "gravel", np.linspace(0.8, 0.6, len(LATERAL_FACTORS)))
    assert in_range(fits.efficiency, real).tolist() == [False, False, True, True, True, False]
    assert verdict([fits, never], real).splitlines() == [
        "wheels, gravel: within the real range at lateral factors 1.4, 1.6, 1.8",
        "tracks, gravel: never within the real range: the nearest is 0.60",
    ]


def test_the_program_prints_its_tables_and_draws(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("matplotlib", reason='not installed: pip install "grouser[plot]"')
    output = tmp_path / "out"
    assert main(["skid-steer", "--data", str(folder), "--output", str(output)]) == 0
    printed = capsys.readouterr().out
    assert re.search(r"run0\W+0\.3[78]", printed) and re.search(r"run1\W+0\.4[12]", printed)
    assert "within the recorded 0.38 to 0.42" in printed
    assert (output / "skid-steer.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (None, "holds no run*.csv"),
        ("1 2 3\n", "expected 8 numbers, found 3 entries"),
        ("1 2 3 4 5 6 7 8\n" * 20, "run0.csv has 20 rows; at least 100 are needed"),
    ],
)
def test_bad_data_is_refused(
    content: str | None, words: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    if content is not None:
        (tmp_path / "run0.csv").write_text(content)
    assert main(["skid-steer", "--data", str(tmp_path), "--no-plots"]) == 2
    assert words in " ".join(capsys.readouterr().err.split())


def test_a_missing_folder_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["skid-steer", "--data", str(tmp_path / "nowhere"), "--no-plots"]) == 2
    assert "is no folder; --data names the one that holds run*.csv" in capsys.readouterr().err


def test_the_simulator_turns_as_little_as_the_real_robot_did(
    capsys: pytest.CaptureFixture[str],
) -> None:
    """On the recorded drives, which are not ours to ship: 0.36 to 0.43 of what the wheels say."""
    data = Path(os.environ.get("GROUSER_DATA", Path(__file__).parents[3] / "shared/data"))
    folder = data / "skid_steer"
    if not folder.is_dir():
        pytest.skip(f"no recording at {folder}; set GROUSER_DATA to its parent")
    real = [yaw_efficiency(run.position, run.yaw_rate) for run in read_runs(folder)]
    assert min(real) == pytest.approx(0.36, abs=0.01) and max(real) == pytest.approx(0.43, abs=0.01)
    assert SkidSteer(data=folder, no_plots=True).run() == 0
    said = capsys.readouterr().out.splitlines()
    assert "wheels, gravel: within the real range at lateral factors 1.6, 1.8, 2.0" in said
    assert any(line.startswith("tracks, gravel: never within the real range") for line in said)
