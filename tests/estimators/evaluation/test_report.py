"""The table fits a terminal and says what it shows; the plots carry names and units."""

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from rich.console import Console

from grouser.estimators.evaluation import plots
from grouser.estimators.evaluation.comparison import compare_open_loop
from grouser.estimators.evaluation.results import ResultsFolder
from grouser.estimators.evaluation.summary import Summary, summarise
from grouser.estimators.evaluation.table import results_table

Make = Callable[..., Any]
SUFFIXES = ("_m", "_deg", "mean", "percent", "percent_3d", "median", "p95")


@pytest.fixture
def folder(tmp_path: Path, robot: Make, witness: Make) -> ResultsFolder:
    """Two estimators, two seeds."""
    results = ResultsFolder(tmp_path, {})
    for seed in (0, 1):
        estimators = {"five-point-ransac": witness(), "other": witness()}
        for run in compare_open_loop(
            robot(), estimators, lambda _: np.array([0.4, 0.6]), seed=seed, steps=30
        ):
            results.add(run, summarise(run, "world:yard"))
    return results


def printed(summaries: list[Summary], width: int) -> str:
    console = Console(width=width)
    with console.capture() as capture:
        console.print(results_table(summaries, "world:yard", width=width))
    return capture.get()


def test_the_table_has_a_row_an_estimator_with_the_mean(folder: ResultsFolder) -> None:
    text = printed(folder.summaries, 100)
    mean = np.mean([s["final_error_m"] for s in folder.summaries if s["estimator"] == "other"])
    (row,) = [line for line in text.splitlines() if line.strip().startswith("other")]
    assert f"{mean:.3f}" in row.split()
    assert "Means over 2 runs" in text
    assert "ATE aligned by SE(2)" in text


def test_the_table_fits_a_hundred_columns_whatever_the_figures(folder: ResultsFolder) -> None:
    for value in (1234.5678, 0.00012, 99999.0):
        wild = [s | {key: value for key in s if key.endswith(SUFFIXES)} for s in folder.summaries]
        text = printed(wild, 100)
        assert "…" not in text
        assert "five-point-ransac" in text


def test_a_narrow_terminal_loses_figures_but_no_digits(folder: ResultsFolder) -> None:
    """A usual terminal is 80 characters wide."""
    wide, narrow = printed(folder.summaries, 100).split(), printed(folder.summaries, 80).split()
    for width in (60, 80):
        text = printed(folder.summaries, width)
        assert "…" not in text and max(map(len, text.splitlines())) <= width
        row = next(line for line in text.splitlines() if line.strip().startswith("five-point"))
        assert set(row.split()) <= set(wide), "no number is cut"
    assert "p95" in wide and "results.json," not in wide
    assert "p95" not in narrow and "ms_per_frame_p95," in narrow and "results.json," in narrow
    assert {"NEES", "ATE", "ms", "lost"} <= set(narrow)


def test_a_figure_that_no_run_has_is_a_dash(folder: ResultsFolder) -> None:
    bare = [dict.fromkeys(s, None) | {"estimator": "other"} for s in folder.summaries]
    (row,) = [line for line in printed(bare, 100).splitlines() if " other" in line]
    assert set(row.split()[1:]) == {"-"}


def test_every_seed_gets_its_plots(folder: ResultsFolder) -> None:
    drawn = plots.plot_results(folder)
    names = [f"{kind}_seed{s}.png" for s in (0, 1) for kind in ("top_view", "error_over_distance")]
    assert [path.name for path in drawn] == names
    for path in drawn:
        image = cv2.imread(str(path))
        assert image is not None and image.shape[1] == 960
        assert image.std() > 5, "something is drawn"


def test_the_plots_name_their_axes_with_units_and_their_lines(folder: ResultsFolder) -> None:
    runs = [run for run in folder.trajectories() if run.seed == 0]
    (view,) = plots.top_view(runs).axes
    assert (view.get_xlabel(), view.get_ylabel()) == ("x [m]", "y [m]")
    assert view.get_aspect() == 1.0
    labels = [text.get_text() for text in view.get_legend().get_texts()]
    assert labels == ["truth", "five-point-ransac", "other", "start"]
    position, heading = plots.error_over_distance(runs).axes
    assert position.get_ylabel() == "position error [m]"
    assert heading.get_ylabel() == "heading error [deg]"
    assert heading.get_xlabel() == "distance driven [m]"


def test_estimators_that_drove_themselves_have_a_truth_each(folder: ResultsFolder) -> None:
    a = [run for run in folder.trajectories() if run.estimator == "other"]
    assert a[0].truth is not None and a[1].truth is not None
    a[1].truth.poses[:, 0, 3] += 0.1
    (view,) = plots.top_view(a).axes
    labels = [text.get_text() for text in view.get_legend().get_texts()]
    assert labels.count("truth of other") == 2


def test_an_ellipse_is_one_sigma_of_its_covariance(folder: ResultsFolder) -> None:
    run = folder.trajectories()[0]
    assert run.estimate.covariances is not None
    P = np.array([[4.0, 1.5], [1.5, 1.0]])
    run.estimate.covariances[-1, :2, :2] = P
    ellipse = plots._ellipses(run, "black")[-1]
    c, s = np.cos(np.radians(ellipse.angle)), np.sin(np.radians(ellipse.angle))
    axes = np.array([[c, -s], [s, c]]) * [ellipse.width / 2, ellipse.height / 2]
    np.testing.assert_allclose(axes @ axes.T, P, atol=1e-9)
    np.testing.assert_allclose(ellipse.center, run.estimate.poses[-1, :2, 3])


def test_without_matplotlib_it_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(plots, "find_spec", lambda name: None)
    with pytest.raises(ImportError, match=r'pip install "grouser\[plot\]", or give --no-plots'):
        plots.require_matplotlib()


def test_plots_load_matplotlib_only_when_they_draw() -> None:
    code = "import sys, grouser.estimators.evaluation.plots; print('matplotlib' in sys.modules)"
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert result.stdout.strip() == "False", result.stderr
