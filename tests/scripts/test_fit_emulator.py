"""`grouser fit-emulator` turns a comparison into an emulator that can be driven under."""

import json
from pathlib import Path

import pytest

from grouser.estimators.emulation.agreement import MEASURES
from grouser.estimators.emulation.model_file import load_model
from grouser.scripts.cli import main


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("results") / "plain"
    arguments = ["--estimators", "ground-truth", "dead-reckoning", "--dynamics", "fast"]
    counts = ["--seeds", "3", "--steps", "150", "--no-plots", "--output", str(folder)]
    assert main(["compare", *arguments, *counts]) == 0
    return folder


def test_an_emulator_is_fitted(
    results: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    output = tmp_path / "emulators"
    assert main(["fit-emulator", "--results", str(results), "--output", str(output)]) == 0
    assert "dead-reckoning" in capsys.readouterr().out
    model = load_model(str(output / "dead-reckoning.json"))
    assert model.of == "dead-reckoning" and model.runs == 2 and "world=yard" in model.source
    assert model.transitions[1].tolist() == [0, 1, 0], "dead reckoning always coasts"
    distances = json.loads((output / "agreement.json").read_text())
    assert list(distances) == ["dead-reckoning"], "the truth is not emulated"
    assert set(distances["dead-reckoning"]) == set(MEASURES)
    assert (output / "dead-reckoning.png").stat().st_size > 10_000


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--estimators", "icr-ekf"], "hold no 'icr-ekf' to emulate; they hold: ['dead-reckoning'"),
        (["--results", "nowhere"], "nowhere holds no results; `grouser compare --output nowhere`"),
    ],
)
def test_misuse_is_explained(
    results: Path,
    tmp_path: Path,
    arguments: list[str],
    words: str,
    capsys: pytest.CaptureFixture[str],
) -> None:
    given = ["--results", str(results), "--output", str(tmp_path), *arguments]
    assert main(["fit-emulator", *given]) == 2
    assert words in capsys.readouterr().err
