"""Error models survive a file; what is wrong with one is said."""

import json
from pathlib import Path

import numpy as np
import pytest

from grouser.estimators.emulation.error_model import ErrorModel
from grouser.estimators.emulation.model_file import fitted_names, load_model, save_model
from tests.estimators.emulation.models import drifting


def test_a_model_survives_its_file(tmp_path: Path) -> None:
    path = tmp_path / "mine.json"
    save_model(path, drifting())
    again = load_model(str(path))
    assert again.to_json() == drifting().to_json()


@pytest.mark.parametrize("name", fitted_names())
def test_shipped_models_are_of_whom_they_say(name: str) -> None:
    model = load_model(name)
    assert name.startswith(model.of) and model.dt == pytest.approx(0.1) and model.runs >= 10


def test_five_estimators_come_with_a_model() -> None:
    assert len(fitted_names()) >= 5 and "ekf-line-slam" in fitted_names()


def test_wrong_names_and_files_are_explained(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"no emulator of 'ekf-line-slm' .* mean 'ekf-line-slam'"):
        load_model("ekf-line-slm")
    with pytest.raises(ValueError, match=r"there is no file .*none.json; `grouser fit-emulator`"):
        load_model(str(tmp_path / "none.json"))
    (tmp_path / "a.json").write_text("[]")
    with pytest.raises(ValueError, match="a.json is no emulator: it holds no JSON object"):
        load_model(str(tmp_path / "a.json"))
    values = drifting().to_json()
    del values["jitter"]
    (tmp_path / "b.json").write_text(json.dumps(values | {"jiter": 1}))
    with pytest.raises(ValueError, match=r"missing: \['jitter'\], unknown: \['jiter'\]"):
        load_model(str(tmp_path / "b.json"))


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        (
            {"jitter": np.zeros(3)},
            r"jitter of an emulator must be finite .* of shape \(3, 3\)",
        ),
        ({"growth": -np.ones((3, 3, 3))}, "growth of an emulator must not be negative"),
        ({"transitions": np.zeros((3, 3))}, "transitions of an emulator must be probabilities"),
    ],
)
def test_wrong_numbers_are_explained(changes: dict[str, object], words: str) -> None:
    with pytest.raises(ValueError, match=words):
        ErrorModel.from_json(drifting().to_json() | changes)


def test_the_one_with_outages_is_lost_and_finds_its_way_again() -> None:
    plain, outages = load_model("ekf-line-slam"), load_model("ekf-line-slam-outages")
    stays = np.diag(outages.transitions)
    assert plain.transitions[0, 0] == 1 and 0.9 < stays[0] < 1 and 0.9 < stays[1] < 1
    assert outages.transitions[1, 2] > 0 and stays[2] < 1  # LOST, and not for good
    assert (outages.recovery > 0.5).all()
    blind, seeing = outages.growth[1].sum(), outages.growth[0].sum()
    assert blind > 3 * seeing
