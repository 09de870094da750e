"""The command from end to end, with little of everything: the page, its numbers, their laws."""

import json
import re
from pathlib import Path

import pytest

from grouser.scripts.cli import main
from grouser.scripts.reproduction.zhao.contenders import contenders
from grouser.scripts.reproduction.zhao.paper import paper_figures

NAMES = ["one-point-ransac", "dead-reckoning"]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("reproduction")
    assert reproduce(path) == 0
    return path


def reproduce(path: Path, *more: str) -> int:
    arguments = ["reproduce", "zhao", "--quick", "--jobs", "1", "--output", str(path)]
    return main([*arguments, "--estimators", *NAMES, *more])


def test_every_number_on_the_page_is_in_the_results(folder: Path) -> None:
    results = json.loads((folder / "results.json").read_text())
    html = (folder / "page.html").read_text()
    shown = re.findall(r'<data value="([^"]*)" title="([^"]*)">', html)
    assert len(shown) > 400
    for value, name in shown:
        assert (results[name] is None) if value == "" else float(value) == results[name]
    cells = re.findall(r"<td[^>]*>(.*?)</td>", html)
    assert len(cells) > 200
    words = "words"
    for kind, cell in re.findall(r'<td class="([^"]*)">(.*?)</td>', html):
        if words not in kind:
            left = re.sub(r"<data[^>]*>.*?</data>|<span[^>]*>.*?</span>", "", cell)
            assert not re.search(r"\d", left), cell


def test_the_papers_numbers_stand_beside_ours(folder: Path) -> None:
    results = json.loads((folder / "results.json").read_text())
    html = (folder / "page.html").read_text()
    for name, value in paper_figures().items():
        assert results[name] == value
        assert f'title="{name}"' in html, "it is shown"


def test_the_page_needs_nothing_else(folder: Path) -> None:
    html = (folder / "page.html").read_text()
    assert not re.search(r'(src|href)="(?!data:|#)', html)
    assert "<script" not in html and html.count('src="data:image/png') >= 10


def test_what_was_lost_is_done_again_and_is_the_same(folder: Path) -> None:
    before = json.loads((folder / "results.json").read_text())
    for name in ("linear-indoors-1", "errata", "slip-ice-tight"):
        (folder / "experiments" / f"{name}.npz").unlink()
    (folder / "page.html").unlink()
    assert reproduce(folder, "--resume") == 0
    after = json.loads((folder / "results.json").read_text())
    assert before.keys() == after.keys()
    differing = {name for name in before if before[name] != after[name]}
    assert all(name.startswith("slip.ice-tight.") and name.endswith(".ms") for name in differing)
    assert (folder / "page.html").exists()


def test_results_are_not_mixed(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert reproduce(folder) == 2
    assert "already holds experiments; give --resume" in capsys.readouterr().err
    others = ["reproduce", "zhao", "--output", str(folder), "--resume", "--estimators", NAMES[0]]
    assert main(others) == 2
    assert "was begun with other settings: estimators" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--jobs", "0"], "--jobs must be at least 1, got 0"),
        (["--resume"], "--resume needs --output: the folder to go on with"),
        (["--estimators", "one-pont-ransac"], "no estimator is named 'one-pont-ransac'; did you"),
        (["--estimators", "ekf-line-slam"], "'ekf-line-slam' needs lines, which the robot"),
        (["--estimators", "dead-reckoning"], "'one-point-ransac', is not among --estimators dead"),
        (["--estimators", "ground-truth"], "'ground-truth' needs true_pose, true_pose_3d, which"),
    ],
)
def test_misuse_is_refused_in_one_line(
    arguments: list[str],
    words: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["reproduce", "zhao", *arguments]) == 2
    error = capsys.readouterr().err
    assert error.startswith("grouser reproduce: error: ") and words in error
    assert error.count("\n") == 1 and not list(tmp_path.iterdir())


def test_missing_matplotlib_is_told_before_the_work(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    from grouser.estimators.evaluation import plots

    monkeypatch.setattr(plots, "find_spec", lambda name: None)
    assert main(["reproduce", "zhao", "--output", str(tmp_path / "a")]) == 2
    error = capsys.readouterr().err
    assert 'pip install "grouser[plot]"; a page without figures is none' in error
    assert "--no-plots" not in error


def test_an_unknown_paper_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as stop:
        main(["reproduce", "einstein"])
    assert stop.value.code == 2 and "zhao" in capsys.readouterr().err


def test_all_registered_rivals_take_part_and_the_papers_method_is_first() -> None:
    names = contenders()
    assert names[0] == "one-point-ransac" and "ground-truth" not in names
    assert {"five-point-ransac", "dead-reckoning"} <= set(names)
    assert "ekf-line-slam" not in names, "this paper's robot shows no lines"
