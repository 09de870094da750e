"""`grouser evaluate` from end to end: paired, repeatable, resumable, the same wherever it runs."""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from grouser.scripts.cli import main

PAIR = ["--estimators", "dead-reckoning", "ground-truth"]
FAST = ["--policy", "pursuit", "--dynamics", "fast", "--processes", 1]


def run(*arguments: object) -> int:
    return main(["evaluate", *map(str, arguments)])


def read(folder: Path, name: str = "results.json") -> list[dict[str, Any]]:
    told: list[dict[str, Any]] = json.loads((folder / name).read_text())
    return told


def test_results_hold_an_object_an_estimator(tmp_path: Path) -> None:
    assert run(*FAST, *PAIR, "--episodes", 3, "--seed", 5, "--output", tmp_path / "a") == 0
    reckoned, truth = read(tmp_path / "a")
    assert (reckoned["estimator"], truth["estimator"]) == ("dead-reckoning", "ground-truth")
    for name in ("success", "spl", "soft_spl", "collisions", "spl_low", "spl_high"):
        assert 0 <= reckoned[name] <= 1
    assert truth["price_of_estimation"] == 0 and truth["success"] == 1
    assert reckoned["price_of_estimation"] == pytest.approx(truth["spl"] - reckoned["spl"])
    episodes = read(tmp_path / "a", "episodes.json")
    assert [e["seed"] for e in episodes] == [5, 6, 7] * 2
    assert reckoned["spl"] == pytest.approx(sum(e["spl"] for e in episodes[:3]) / 3)


def test_the_price_is_known_where_the_true_pose_was_not_asked_for(tmp_path: Path) -> None:
    common = [*FAST, "--episodes", 2, "--goals", 2]
    assert run(*common, *PAIR, "--output", tmp_path / "a") == 0
    assert run(*common, "--estimators", "dead-reckoning", "--output", tmp_path / "b") == 0
    assert read(tmp_path / "b") == read(tmp_path / "a")[:1]


def test_processes_and_resumption_change_no_byte(tmp_path: Path) -> None:
    common = [*FAST, *PAIR, "--open-loop", "--output"]
    assert run(*common, tmp_path / "a", "--episodes", 3) == 0
    assert run(*common, tmp_path / "b", "--episodes", 1) == 0
    assert run(*common, tmp_path / "b", "--episodes", 3, "--resume", "--processes", 2) == 0
    for name in ("results.json", "episodes.json", "open_loop.json", "settings.json"):
        assert (tmp_path / "a" / name).read_bytes() == (tmp_path / "b" / name).read_bytes()


@pytest.fixture
def cluster() -> Iterator[str]:
    """Two nodes on this machine."""
    pytest.importorskip("ray", reason='Ray is not installed: pip install "grouser[ray]"')
    from ray.cluster_utils import Cluster

    nodes = Cluster(
        initialize_head=True, head_node_args={"num_cpus": 1, "include_dashboard": False}
    )
    nodes.add_node(num_cpus=1)
    yield nodes.address
    nodes.shutdown()


def test_a_ray_cluster_changes_no_byte(tmp_path: Path, cluster: str) -> None:
    common = [*FAST, *PAIR, "--episodes", 1, "--time-limit", 10, "--output"]
    assert run(*common, tmp_path / "a") == 0
    assert run(*common, tmp_path / "b", "--ray", cluster) == 0
    for name in ("results.json", "episodes.json"):
        assert (tmp_path / "a" / name).read_bytes() == (tmp_path / "b" / name).read_bytes()


def test_drivers_make_rows_of_their_own(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    drivers = ["--policy", "pursuit", "straight", *FAST[2:]]
    names = ["--estimators", "ground-truth"]
    assert (
        run(*drivers, *names, "--episodes", 3, "--output", tmp_path / "a", "--world", "room") == 0
    )
    pursued, straight = read(tmp_path / "a")
    assert (pursued["policy"], straight["policy"]) == ("pursuit", "straight")
    assert pursued["success"] > straight["success"]
    assert "…" not in capsys.readouterr().out, "the table is cropped"


def test_the_gap_is_told_for_each_driver(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    names = ["--estimators", "ground-truth", "dead-reckoning", "emulated"]
    options = [*FAST, *names, "--episodes", 2, "--open-loop", "--output", tmp_path / "a"]
    assert run(*options) == 0
    (gap,) = read(tmp_path / "a", "gap.json")
    assert set(gap["by_ate"]) == set(gap["by_spl"]) == {"dead-reckoning", "emulated"}
    watched = read(tmp_path / "a", "open_loop.json")
    assert len(watched) == 6
    assert all(w["ate_m"] < 1e-9 for w in watched if w["estimator"] == "ground-truth")
    said = capsys.readouterr().out
    assert "Kendall's tau between both orders" in said and "…" not in said


def test_latencies_make_objects_and_a_plot_of_their_own(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    common = [*FAST, "--episodes", 3, "--estimators", "ground-truth", "dead-reckoning"]
    swept, alone = tmp_path / "swept", tmp_path / "alone"
    assert run(*common, "--pose-latency", 0, 0.8, "--output", swept) == 0
    assert "…" not in capsys.readouterr().out, "the table is cropped"
    assert (swept / "latency.png").stat().st_size > 10_000
    told = read(swept)
    assert [(s["estimator"], s["pose_latency"]) for s in told] == [
        (name, late) for late in (0.0, 0.8) for name in ("ground-truth", "dead-reckoning")
    ]
    assert told[2]["position_error_m"] > told[0]["position_error_m"] + 0.1
    assert run(*common, "--output", alone) == 0
    assert read(alone) == told[:2]
    assert not (alone / "latency.png").exists()
    assert run(*common, "--pose-latency", 0, 0.8, "--output", alone, "--resume") == 0
    assert read(alone) == told


def test_drivers_are_contrasted_with_the_first(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    drivers = ["--policy", "straight", "pursuit", *FAST[2:], "--world", "room"]
    names = ["--estimators", "ground-truth", "emulated:icr-ekf"]
    assert run(*drivers, *names, "--episodes", 3, "--output", tmp_path / "a") == 0
    scores = {(s["policy"], s["estimator"]): s for s in read(tmp_path / "a")}
    for gain in read(tmp_path / "a", "drivers.json"):
        assert (gain["policy"], gain["against"]) == ("pursuit", "straight")
        mine, other = (scores[who, gain["estimator"]] for who in ("pursuit", "straight"))
        assert gain["spl_gain"] == pytest.approx(mine["spl"] - other["spl"])
        assert gain["spl_gain_low"] <= gain["spl_gain"] <= gain["spl_gain_high"]
    assert "pursuit over straight, emulated:icr-ekf: SPL" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--policy", "pursiut"], "no driver is named 'pursiut', and no file is there; did you"),
        (["--episodes", "0"], "--episodes must be at least 1, got 0"),
        (["--seed", "-1"], "--seed must be at least 0, got -1"),
        (["--estimators", "one-point-ransack"], "one-point-ransac"),
        (["--estimators", "emulated:icr-efk"], "no emulator of 'icr-efk' comes with Grouser"),
        (["--world", "yrad"], "yard"),
        (["--pose-latency", "-1"], "pose_latency must be 0 s or more"),
        (["--resume"], "--resume needs --output: the folder of the results to complete"),
        (["--effects", "lidar.glass"], "'lidar.glass' is not NAME=AMOUNT"),
    ],
)
def test_misuse_is_refused_before_any_work(
    options: list[str], message: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    output = [] if "--resume" in options else ["--output", tmp_path / "a"]
    assert run("--policy", "pursuit", *options, *output) == 2
    assert message in " ".join(capsys.readouterr().err.split())
    assert not (tmp_path / "a").exists()


def test_a_folder_is_not_mixed_up(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    common = [*FAST, "--estimators", "ground-truth", "--episodes", 1, "--output", tmp_path / "a"]
    assert run(*common) == 0
    assert run(*common) == 2
    assert "already holds results; give --resume" in capsys.readouterr().err
    assert run(*common, "--resume", "--goals", 2) == 2
    assert "was begun with other settings: goals 1 (now 2)" in capsys.readouterr().err
