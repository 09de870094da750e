"""The folder of results survives a crash at any time, resumes, and never mixes settings."""

import json
import os
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from evo.tools import file_interface

from grouser.estimators.evaluation.comparison import Run, compare_open_loop
from grouser.estimators.evaluation.results import ResultsFolder
from grouser.estimators.evaluation.summary import summarise
from grouser.geometry import project

Make = Callable[..., Any]
SETTINGS = {"world": "yard", "steps": 10, "rig": {"a": (1, 2)}}


@pytest.fixture
def run(robot: Make, witness: Make) -> Run:
    drive = np.array([0.4, 0.6])
    (done,) = compare_open_loop(robot(), {"w": witness()}, lambda _: drive, seed=2, steps=10)
    return done


def keep(folder: ResultsFolder, run: Run) -> None:
    folder.add(run, summarise(run, "world:yard"))


def test_a_run_is_kept(tmp_path: Path, run: Run) -> None:
    folder = ResultsFolder(tmp_path / "new", SETTINGS)
    assert not folder.has("w", 2)
    keep(folder, run)
    assert folder.has("w", 2) and not folder.has("w", 1) and not folder.has("v", 2)
    (kept,) = json.loads((tmp_path / "new/results.json").read_text())
    assert kept == summarise(run, "world:yard")
    (trajectories,) = folder.trajectories()
    assert run.true_poses is not None and trajectories.truth is not None
    assert trajectories.estimate.covariances is not None
    estimates = np.array([e.pose for e in run.estimates])
    P = np.array([e.covariance for e in run.estimates])
    np.testing.assert_allclose(project(trajectories.estimate.poses), estimates, atol=1e-9)
    np.testing.assert_allclose(trajectories.estimate.covariances, P, atol=1e-12)
    np.testing.assert_allclose(project(trajectories.truth.poses), run.true_poses, atol=1e-9)
    assert trajectories.statuses == tuple(e.status for e in run.estimates)


def test_evo_reads_the_trajectories(tmp_path: Path, run: Run) -> None:
    keep(ResultsFolder(tmp_path, SETTINGS), run)
    for name in ("w_seed2.tum", "truth/w_seed2.tum"):
        path = tmp_path / "trajectories" / name
        assert file_interface.read_tum_trajectory_file(str(path)).num_poses == 11


def test_results_are_resumed(tmp_path: Path, run: Run) -> None:
    keep(ResultsFolder(tmp_path, SETTINGS), run)
    folder = ResultsFolder(tmp_path, SETTINGS, resume=True)
    assert folder.has("w", 2)
    assert len(folder.trajectories()) == 1


def test_resuming_nothing_begins(tmp_path: Path) -> None:
    assert ResultsFolder(tmp_path / "new", SETTINGS, resume=True).summaries == []
    assert not (tmp_path / "new").exists(), "nothing is written before there is something to keep"


def test_results_are_not_overwritten(tmp_path: Path, run: Run) -> None:
    keep(ResultsFolder(tmp_path, SETTINGS), run)
    with pytest.raises(ValueError, match=r"already holds results; give --resume .* another --out"):
        ResultsFolder(tmp_path, SETTINGS)


def test_settings_are_not_mixed(tmp_path: Path, run: Run) -> None:
    keep(ResultsFolder(tmp_path, SETTINGS), run)
    with pytest.raises(ValueError, match=r"other settings: steps 10 \(now 20\); .* another --out"):
        ResultsFolder(tmp_path, {**SETTINGS, "steps": 20}, resume=True)


@pytest.mark.parametrize("name", ["settings.json", "results.json"])
@pytest.mark.parametrize("content", [b"{", b"1", b"[1]", b'[{"seed": 2}]', b"\xff"])
def test_a_damaged_file_is_named(tmp_path: Path, run: Run, name: str, content: bytes) -> None:
    keep(ResultsFolder(tmp_path, SETTINGS), run)
    (tmp_path / name).write_bytes(content)
    with pytest.raises(ValueError, match=rf"{name} cannot be resumed from"):
        ResultsFolder(tmp_path, SETTINGS, resume=True)


def test_a_run_whose_trajectory_is_gone_is_told_before_the_work(tmp_path: Path, run: Run) -> None:
    keep(ResultsFolder(tmp_path, SETTINGS), run)
    (tmp_path / "trajectories/with_covariance/w_seed2.tum").unlink()
    with pytest.raises(ValueError, match=r"lists a run that is not whole .*w_seed2.tum is missing"):
        ResultsFolder(tmp_path, SETTINGS, resume=True)


def test_a_crash_while_writing_loses_nothing_that_was_there(
    tmp_path: Path, run: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = ResultsFolder(tmp_path, SETTINGS)
    keep(folder, run)
    before = (tmp_path / "results.json").read_bytes()

    def crash(source: Any, target: Any) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(os, "replace", crash)
    with pytest.raises(KeyboardInterrupt):
        keep(folder, run)
    assert (tmp_path / "results.json").read_bytes() == before


def test_not_a_number_is_never_written(tmp_path: Path, run: Run) -> None:
    """JSON has no NaN; a reader would choke on it long after."""
    folder = ResultsFolder(tmp_path, SETTINGS)
    for value in (float("nan"), np.float64(np.inf)):
        with pytest.raises(ValueError, match=r"^w, seed 2: ate_m cannot be written as JSON"):
            folder.add(run, {**summarise(run, "x"), "ate_m": value})
    assert folder.summaries == [] and list(tmp_path.iterdir()) == []


def test_a_place_that_cannot_be_written_to_is_refused_before_the_work(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    for place in ("file", "file/deep"):
        with pytest.raises(ValueError, match=r"cannot be written to .*file is not a folder that"):
            ResultsFolder(tmp_path / place, SETTINGS)


def test_a_name_with_a_slash_is_a_file_name(tmp_path: Path, run: Run) -> None:
    folder = ResultsFolder(tmp_path, SETTINGS)
    keep(folder, replace(run, estimator="mine/best"))
    assert (tmp_path / "trajectories/mine-best_seed2.tum").exists()
    assert folder.trajectories()[0].estimator == "mine/best"
