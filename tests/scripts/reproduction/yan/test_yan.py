"""The command from end to end, with little of everything: the page, its numbers, their laws."""

import json
import re
from pathlib import Path

import pytest

from grouser.scripts.cli import main
from grouser.scripts.reproduction.yan.paper import paper_figures


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("reproduction")
    assert reproduce(path) == 0
    return path


def reproduce(path: Path, *more: str) -> int:
    return main(["reproduce", "yan", "--quick", "--jobs", "1", "--output", str(path), *more])


def results_of(folder: Path) -> dict[str, float | None]:
    read: dict[str, float | None] = json.loads((folder / "results.json").read_text())
    return read


def test_every_number_on_the_page_is_in_the_results(folder: Path) -> None:
    results = results_of(folder)
    html = (folder / "page.html").read_text()
    shown = re.findall(r'<data value="([^"]*)" title="([^"]*)">', html)
    assert len(shown) > 300
    for value, name in shown:
        assert (results[name] is None) if value == "" else float(value) == results[name]
    for kind, cell in re.findall(r'<td class="([^"]*)">(.*?)</td>', html):
        if "words" not in kind:
            left = re.sub(r"<data[^>]*>.*?</data>|<span[^>]*>.*?</span>", "", cell)
            assert not re.search(r"\d", left), cell


def test_the_papers_numbers_stand_beside_ours(folder: Path) -> None:
    results = results_of(folder)
    html = (folder / "page.html").read_text()
    for name, value in paper_figures().items():
        assert results[name] == value
        assert f'title="{name}"' in html, "it is shown"
    assert not re.search(r'(src|href)="(?!data:|#)', html), "the page needs nothing else"
    assert html.count('src="data:image/png') >= 6


def test_what_a_reader_asks_for_first_is_at_the_top_of_the_results(folder: Path) -> None:
    results = results_of(folder)
    rms, nees, lines = (results[name] for name in ("rms_m", "nees", "lines"))
    assert rms is not None and 0.02 < rms < 0.5
    assert nees is not None and 0.5 < nees < 9, "of two drives"
    assert lines == 4
    end, without_noise = results["over_range_end_m"], results["noise_free_end_m"]
    assert end is not None and 53.3 < end < 55.3
    assert without_noise == pytest.approx(54.166, abs=0.01)


def test_what_holds_with_two_drives_already(folder: Path) -> None:
    results = results_of(folder)
    for name in ("errata.worst_jacobian", "observer.mismatches", "observer.worst_m"):
        assert results[f"verdict.{name}"] == 1
    printed, corrected = (results[f"normal.{form}.nees"] for form in ("printed", "corrected"))
    assert printed is not None and corrected is not None and printed > 3 * corrected
    of_heading = {form: results[f"heading_10_deg.{form}.heading_sigma_end_deg"]
                  for form in ("corrected", "first-estimates", "right-invariant")}  # fmt: skip
    assert of_heading["corrected"] is not None and of_heading["corrected"] < 5
    for form in ("first-estimates", "right-invariant"):
        assert of_heading[form] == pytest.approx(10, abs=0.5), "the heading cannot be seen"
    assert results["honesty.printed.plane_nees_leaves_at_deg"] == 0


def test_what_was_lost_is_done_again_and_is_the_same(folder: Path) -> None:
    before = results_of(folder)
    for name in ("trajectory-yan-normal", "errata", "heading-10-deg-0"):
        (folder / "experiments" / f"{name}.npz").unlink()
    (folder / "page.html").unlink()
    assert reproduce(folder, "--resume") == 0
    assert results_of(folder) == before
    assert (folder / "page.html").exists()


def test_estimators_are_of_the_other_paper(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert reproduce(tmp_path / "a", "--estimators", "ekf-line-slam") == 2
    assert "--estimators is of zhao" in capsys.readouterr().err
    assert not (tmp_path / "a").exists()
