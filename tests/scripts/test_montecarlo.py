"""`grouser montecarlo` prints a table, writes every score, and refuses in one line."""

import json
from pathlib import Path

import pytest

from grouser.scripts.cli import main


def test_a_short_run_prints_and_writes(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    output = tmp_path / "scores.json"
    asked = ["montecarlo", "--scenarios", "spot", "--methods", "dead-reckoning", "one-point"]
    asked += ["--seeds", "2", "--processes", "1", "--output", str(output)]
    assert main(asked) == 0
    table = " ".join(capsys.readouterr().out.split())
    for words in ("360 degrees on the spot", "dead-reckoning", "one-point", "NEES", "prototype"):
        assert words in table
    written = json.loads(output.read_text())
    assert len(written["runs"]) == 4 and len(written["means"]) == 2
    runs = [run["degrees"] for run in written["runs"] if run["method"] == "one-point"]
    assert written["means"][1]["degrees"] == pytest.approx(sum(runs) / 2)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--scenarios", "linaer"], "there is no scenario 'linaer'; there are: linear, linear-off"),
        (["--methods", "orb"], "there is no method 'orb'; there are: dead-reckoning, one-point-fr"),
        (["--seeds", "0"], "--seeds must be at least 1, got 0"),
        (["--processes", "0"], "--processes must be at least 1, got 0"),
        (["--noise-px", "0"], "--noise-px must be above zero, got 0.0"),
        (["--outliers", "1"], "--outliers must be at least 0 and below 1, got 1.0"),
        (["--output", "/nowhere/a.json"], "--output: there is no folder /nowhere; make it first"),
    ],
)
def test_misuse_is_told_before_anything_is_run(
    arguments: list[str], words: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["montecarlo", *arguments]) == 2
    assert f"grouser montecarlo: error: {words}" in capsys.readouterr().err
