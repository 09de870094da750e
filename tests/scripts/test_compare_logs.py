"""`grouser compare` and `grouser map` on logs of lidar and odometry."""

import json
from pathlib import Path
from typing import Any

import pytest

from grouser.scripts.cli import main
from tests.envs.recordings.small_logs import N, write_carmen, write_ticks


def results(folder: Path) -> list[dict[str, Any]]:
    found: list[dict[str, Any]] = json.loads((folder / "results.json").read_text())
    return found


def test_a_log_is_compared_on_and_its_noise_makes_runs_of_it(tmp_path: Path) -> None:
    log, out = write_carmen(tmp_path), tmp_path / "a"
    told = ["--odometry-noise", "0.1", "--seeds", "2", "--no-plots", "--output", str(out)]
    assert main(["compare", "--log", str(log), *told]) == 0
    runs = results(out)
    standard = ["ground-truth", "dead-reckoning", "ekf-line-slam"]
    assert [r["estimator"] for r in runs] == standard * 2
    assert runs[0]["source"] == "log:room.log" and runs[0]["steps"] == N - 1
    one, other = (r for r in runs if r["estimator"] == "dead-reckoning")
    assert one["ate_m"] > 0.01 and one["ate_m"] != other["ate_m"]
    assert json.loads((out / "settings.json").read_text())["odometry_noise"] == 0.1


def test_reference_poses_may_be_noisy(tmp_path: Path) -> None:
    log, runs = write_carmen(tmp_path), []
    for sigma in ([], ["--reference-sigma", "0.2", "2"]):
        out = tmp_path / f"a{len(sigma)}"
        told = ["--estimators", "ekf-line-slam", "--no-plots", "--output", str(out), *sigma]
        assert main(["compare", "--log", str(log), *told]) == 0
        runs += results(out)
    assert runs[1]["nees_mean"] < runs[0]["nees_mean"]
    assert runs[1]["final_sigma_m"] > 0.28 > runs[0]["final_sigma_m"]
    assert runs[1]["final_error_m"] == runs[0]["final_error_m"]


def test_ticks_are_compared_on_without_truth(tmp_path: Path) -> None:
    log, out = write_ticks(tmp_path), tmp_path / "a"
    names = ["--estimators", "dead-reckoning", "--no-plots", "--output", str(out)]
    assert main(["compare", "--log", str(log), *names]) == 0
    (run,) = results(out)
    assert run["ate_m"] is None and run["source"] == "log:room.dat"


def test_a_log_is_mapped(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    log, out = write_carmen(tmp_path), tmp_path / "a"
    noise = ["--odometry-noise", "0.02"]
    assert main(["map", "--log", str(log), *noise, "--output", str(out)]) == 0
    told = capsys.readouterr().out
    assert "ekf-line-slam on log:room.log: a map of" in told and "ATE" in told
    assert json.loads((out / "map.geojson").read_text())["features"]
    assert (out / "truth.tum").exists()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["compare", "--odometry-noise", "0.1"], "--odometry-noise is for the odometry of a recor"),
        (["map", "--odometry-noise", "0.1"], "--odometry-noise is for the odometry of a recordin"),
        (["compare", "--log", "LOG", "--odometry-noise", "-1"], "must be a share of zero or more"),
        (
            ["compare", "--reference-sigma", "1", "1"],
            "--reference-sigma is for the reference poses",
        ),
        (
            ["compare", "--log", "LOG", "--reference-sigma", "0.1", "0"],
            "--reference-sigma must be two positive numbers, m and deg, got 0.1 0",
        ),
        (["compare", "--log", "BAD"], "bad.log:4: 'ODO' is no message of a CARMEN log; did you"),
        (["map", "--log", "BAD"], "bad.log:4: 'ODO' is no message of a CARMEN log; did you mean"),
        (
            ["compare", "--log", "LOG", "--estimators", "one-point-ransac"],
            "needs left, right, which log:room.log does not give; it gives lidar, odometry, stamp",
        ),
    ],
)
def test_what_cannot_be_is_refused_before_anything_is_run(
    arguments: list[str], words: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    log = write_carmen(tmp_path)
    (tmp_path / "bad.log").write_text(log.read_text().replace("ODOM", "ODO", 1))
    paths = {"LOG": str(log), "BAD": str(tmp_path / "bad.log")}
    given = [paths.get(word, word) for word in arguments]
    assert main([*given, "--output", str(tmp_path / "a")]) == 2
    told = capsys.readouterr().err
    assert words in " ".join(told.split())
    assert not (tmp_path / "a").exists()
