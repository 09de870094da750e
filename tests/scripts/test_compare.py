"""`grouser compare` from end to end: fair, repeatable, resumable."""

import json
from pathlib import Path
from shutil import copytree
from typing import Any

import numpy as np
import pytest

from grouser.agents.waypoints import SQUARE
from grouser.rig import camera_mount
from grouser.scripts import compare_work
from grouser.scripts.cli import main
from grouser.scripts.compare import Compare
from grouser.scripts.compare_execution import execute
from grouser.trajectory import read_tum

TIMES = ("ms_per_frame_median", "ms_per_frame_p95")
BLIND = ["--estimators", "ground-truth", "dead-reckoning", "--no-plots"]


def run(*arguments: str | int | Path) -> int:
    return main(["compare", *map(str, arguments)])


def results(folder: Path) -> list[dict[str, Any]]:
    """The runs without their times, which alone may differ."""
    runs: list[dict[str, Any]] = json.loads((folder / "results.json").read_text())
    for one in runs:
        for key in TIMES:
            assert key in one
            del one[key]
    return runs


def by_run(runs: list[dict[str, Any]]) -> list[dict[str, Any]]:
    return sorted(runs, key=lambda one: (one["seed"], one["estimator"]))


def test_a_world_is_driven_with_every_estimator_and_seed(tmp_path: Path) -> None:
    assert run(*BLIND, "--seeds", 2, "--steps", 60, "--output", tmp_path / "a") == 0
    runs = results(tmp_path / "a")
    assert [(r["estimator"], r["seed"]) for r in runs] == [
        ("ground-truth", 0),
        ("dead-reckoning", 0),
        ("ground-truth", 1),
        ("dead-reckoning", 1),
    ]
    assert {r["source"] for r in runs} == {"world:yard"}
    assert {r["steps"] for r in runs} == {60}
    for truth, reckoned in zip(runs[::2], runs[1::2], strict=True):
        assert truth["distance_m"] == reckoned["distance_m"] > 1, "they shared a rollout"
        assert truth["final_error_m"] < 1e-9 < reckoned["final_error_m"]
        assert truth["nees_mean"] is None


def test_two_comparisons_give_the_same_results(tmp_path: Path) -> None:
    for name in "ab":
        assert run(*BLIND, "--seeds", 2, "--steps", 30, "--output", tmp_path / name) == 0
    assert results(tmp_path / "a") == results(tmp_path / "b")
    for path in (tmp_path / "a/trajectories").rglob("*.tum"):
        other = tmp_path / "b" / path.relative_to(tmp_path / "a")
        assert path.read_bytes() == other.read_bytes()


def test_resuming_does_what_is_missing_and_gives_what_one_go_gives(tmp_path: Path) -> None:
    go_on = ["--steps", "30", "--no-plots", "--output", str(tmp_path / "a"), "--resume"]
    assert run("--estimators", "dead-reckoning", *go_on) == 0
    first = (tmp_path / "a/results.json").read_text()
    assert run(*BLIND, "--seeds", 2, *go_on) == 0
    kept = json.loads((tmp_path / "a/results.json").read_text())
    assert kept[0] == json.loads(first)[0], "times and all: it was not done again"
    assert run(*BLIND, "--seeds", 2, "--steps", 30, "--output", tmp_path / "b") == 0
    assert by_run(results(tmp_path / "a")) == by_run(results(tmp_path / "b"))


def test_an_interruption_keeps_what_was_done(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Ctrl-C in the second rollout: the first is on disk and reported."""

    def interrupted(plan: Any, on_rollout: Any, on_step: Any) -> None:
        def stop(words: str) -> None:
            if words == "seed 1":
                raise KeyboardInterrupt

        execute(plan, stop, on_step)

    monkeypatch.setattr(compare_work, "execute", interrupted)
    assert run(*BLIND, "--seeds", 2, "--steps", 5, "--output", tmp_path / "a") == 130
    assert [r["seed"] for r in results(tmp_path / "a")] == [0, 0]
    assert "2 runs in" in capsys.readouterr().out
    monkeypatch.undo()
    again = ["--steps", "5", "--output", str(tmp_path / "a"), "--resume"]
    assert run(*BLIND, "--seeds", 2, *again) == 0
    assert len(results(tmp_path / "a")) == 4


def test_waypoints_are_driven_on_the_estimate(tmp_path: Path) -> None:
    arguments = ["--driver", "waypoints", "--output", str(tmp_path / "a")]
    assert run(*BLIND, *arguments) == 0
    truth, reckoned = results(tmp_path / "a")
    assert len(truth["waypoint_misses_m"]) == len(SQUARE)
    assert max(truth["waypoint_misses_m"]) < 0.16, "it knows where it is"
    assert truth["steps"] < 600, "it stops when it is there"
    assert reckoned["distance_m"] != truth["distance_m"], "each drove a course of its own"


def test_only_the_sensors_that_are_read_are_simulated(tmp_path: Path) -> None:
    options = Compare(estimators=("ground-truth", "dead-reckoning"), output=tmp_path / "a")
    plan = compare_work.prepare(options)
    plan.env.close()
    assert set(plan.env.observation_space.spaces) == {"tracks", "stamp"}  # type: ignore[attr-defined]


def test_a_recording_is_replayed_and_tracked(tmp_path: Path, wall_log: Path) -> None:
    names = ["ground-truth", "one-point-ransac", "five-point-ransac"]
    assert run("--log", wall_log, "--output", tmp_path / "a") == 0
    runs = results(tmp_path / "a")
    assert [r["estimator"] for r in runs] == names, "dead-reckoning has no tracks here"
    for one in runs:
        assert (one["source"], one["steps"]) == ("log:wall", 15)
        assert one["distance_m"] == pytest.approx(1.2)
        assert one["final_error_m"] < 0.05
        assert one["lost_fraction"] == 0
    # Not of five-point: a single plane leaves an essential matrix ambiguous.
    assert [r["tracking_fraction"] for r in runs[:2]] == [1, 1]
    assert (tmp_path / "a/top_view_seed0.png").exists()
    assert (tmp_path / "a/error_over_distance_seed0.png").exists()


def test_seeing_estimators_repeat_themselves(tmp_path: Path, wall_log: Path) -> None:
    names = ["one-point-ransac", "five-point-ransac"]
    for folder, order in (("a", names), ("b", names[::-1])):
        options = ["--estimators", *order, "--no-plots", "--output", str(tmp_path / folder)]
        assert run("--log", wall_log, *options) == 0
    assert by_run(results(tmp_path / "a")) == by_run(results(tmp_path / "b"))


def test_a_recording_without_poses_has_no_accuracy(tmp_path: Path, wall_log: Path) -> None:
    bare = Path(copytree(wall_log, tmp_path / "bare"))
    (bare / "poses.txt").unlink()
    assert run("--log", bare, "--steps", 4, "--output", tmp_path / "a") == 0
    assert [r["estimator"] for r in results(tmp_path / "a")] == [
        "one-point-ransac",
        "five-point-ransac",
    ]
    assert {r["ate_m"] for r in results(tmp_path / "a")} == {None}
    assert results(tmp_path / "a")[0]["tracking_fraction"] == 1
    assert [path.name for path in (tmp_path / "a").glob("*.png")] == ["top_view_seed0.png"]


def test_a_damaged_image_ends_a_comparison_in_words(
    tmp_path: Path, wall_log: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    log = tmp_path / "log"
    copytree(wall_log, log)
    damaged = sorted(log.glob("image_[l2]*/*.png"))[5]
    damaged.write_bytes(damaged.read_bytes()[:60])
    options = ["--estimators", "one-point-ransac", "--no-plots", "--output", str(tmp_path / "out")]
    assert main(["compare", "--log", str(log), *options]) == 2
    told = capsys.readouterr().err
    assert f"{damaged.name} cannot be decoded as an image: the file is damaged" in told
    assert "Traceback" not in told


def test_the_camera_of_a_recording_can_be_told(tmp_path: Path, wall_log: Path) -> None:
    options = Compare(
        log=wall_log,
        estimators=("ground-truth",),
        output=tmp_path / "a",
        camera_x=0.5,
        camera_z=1.65,
        camera_pitch_degrees=10,
        disparity_offset_px=0.1,
    )
    stereo = compare_work.prepare(options).rig.stereo
    assert stereo is not None
    expected = camera_mount(0.5, 0.0, 1.65, pitch=np.radians(10))
    np.testing.assert_allclose(stereo.T_base_camera, expected, atol=1e-12)
    assert stereo.T_base_camera[2, 2] < 0, "a positive pitch looks down"
    assert stereo.disparity_offset == 0.1


def test_the_mount_turns_the_course_of_the_robot(tmp_path: Path, wall_log: Path) -> None:
    """A camera that looks to the left of a robot that drives: it moves to the camera's right."""
    told = ["--camera-yaw-degrees", "30", "--estimators", "ground-truth", "--no-plots"]
    assert run("--log", wall_log, *told, "--output", tmp_path / "a") == 0
    end = read_tum(tmp_path / "a/trajectories/ground-truth_seed0.tum").poses[-1, :2, 3]
    np.testing.assert_allclose(end, 1.2 * np.array([np.cos(np.pi / 6), 0.5]), atol=1e-9)


def test_the_default_folder_is_new_and_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert run(*BLIND, "--steps", 3) == 0
    (folder,) = (tmp_path / "results").iterdir()
    assert folder.name.startswith("compare-yard-")
    assert json.loads((folder / "settings.json").read_text()) == {
        "grouser": "0.1.0",
        "world": "yard",
        "driver": "figure-eight",
        "steps": 3,
    }


# --- worlds --------------------------------------------------------------------------------------


@pytest.mark.parametrize("driver", ["tour", "waypoints"])
def test_in_a_narrow_world_the_robot_finds_its_way(driver: str, tmp_path: Path) -> None:
    in_corridor = ["--world", "corridor", "--dynamics", "fast", "--steps", "150"]
    assert run(*BLIND, *in_corridor, "--driver", driver, "--output", tmp_path / "a") == 0
    truth, _ = results(tmp_path / "a")
    assert truth["source"] == "world:corridor" and truth["steps"] == 150
    assert truth["distance_m"] > 3.5, "it was not stopped by a wall"


def test_everything_about_a_world_goes_from_the_command_line_into_the_settings(
    tmp_path: Path,
) -> None:
    told = ["--world", "garden", "--difficulty", "0.8", "--terrain", "mud", "--dynamics", "fast"]
    told += ["--randomize", "light", "friction", "--effects", "tracks.noise=0.05"]
    told += ["--faults", "tracks.left_stuck:1:2", "stereo.darkness:0::0.5"]
    assert run(*BLIND, *told, "--steps", 15, "--output", tmp_path / "a") == 0
    settings = json.loads((tmp_path / "a/settings.json").read_text())
    del settings["grouser"]
    assert settings == {
        "world": "garden",
        "driver": "tour",
        "steps": 15,
        "difficulty": 0.8,
        "terrain": "mud",
        "dynamics": "fast",
        "randomize": ["light", "friction"],
        "effects": {"tracks.noise": 0.05},
        "faults": [
            {"what": "tracks.left_stuck", "start": 1.0, "end": 2.0},
            {"what": "stereo.darkness", "start": 0.0, "amount": 0.5},
        ],
    }
    plain = ["--world", "garden", "--difficulty", "0.8", "--terrain", "mud", "--dynamics", "fast"]
    assert run(*BLIND, *plain, "--steps", 15, "--output", tmp_path / "b") == 0
    assert results(tmp_path / "a")[1]["ate_m"] != results(tmp_path / "b")[1]["ate_m"]


@pytest.mark.parametrize(
    ("told", "words"),
    [
        (["--effects", "tracks.noise"], "'tracks.noise' is not NAME=AMOUNT, such as"),
        (["--effects", "tracks.nois=1"], "did you mean 'tracks.noise'?"),
        (["--faults", "gps.outage:a:b"], "is not NAME:START:END or NAME:START:END:AMOUNT"),
        (["--faults", "gps.outage:5:2"], "must end after it starts"),
        (["--terrain", "lava"], "no terrain is named 'lava'; known:"),
        (["--difficulty", "2"], "difficulty must be in [0, 1]"),
        (["--log", "/nowhere", "--terrain", "mud"], "--terrain describes a simulated world"),
    ],
)
def test_what_a_world_cannot_be_is_refused_in_words(
    told: list[str], words: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(*BLIND, *told, "--output", tmp_path / "a") == 2
    assert words in " ".join(capsys.readouterr().err.split())
    assert not (tmp_path / "a").exists()


def test_a_plane_of_paper_2_is_driven_through_its_course(tmp_path: Path) -> None:
    arguments = ["--world", "yan-over-range", "--estimators", "ground-truth", "--no-plots"]
    assert run(*arguments, "--output", tmp_path / "a") == 0
    (one,) = results(tmp_path / "a")
    assert one["source"] == "world:yan-over-range"
    assert one["steps"] == 2296 and one["distance_m"] == pytest.approx(172.2, abs=0.1)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--difficulty", "1"], "--difficulty does not go with --world yan-normal, a plane"),
        (["--driver", "straight"], "--driver straight does not go with --world yan-normal"),
    ],
)
def test_what_does_not_go_with_a_plane_is_refused(
    arguments: list[str], words: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run("--world", "yan-normal", *arguments, "--output", tmp_path / "a") == 2
    assert words in capsys.readouterr().err
