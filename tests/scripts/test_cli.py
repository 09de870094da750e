"""The command line teaches, and refuses in one line before any long work."""

import subprocess
import sys
from pathlib import Path

import pytest

import grouser
from grouser.estimators.evaluation import plots
from grouser.scripts.cli import main


def test_the_version_is_told(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--version"]) == 0
    assert capsys.readouterr().out == f"grouser {grouser.__version__}\n"


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--help"], ["compare", "worlds", "skid-steer", "--version"]),
        (
            ["compare", "--help"],
            [
                "--world",
                "--log",
                "--estimators",
                "--seeds",
                "--steps",
                "--driver",
                "--output",
                "--resume",
                "--no-plots",
                "--camera-pitch-degrees",
                "grouser compare --seeds 2",
                "figure-eight (default in",
            ],
        ),
    ],
)
def test_help_teaches(
    arguments: list[str], words: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as stop:
        main(arguments)
    assert stop.value.code == 0
    text = " ".join(capsys.readouterr().out.replace("│", " ").split())
    for word in words:
        assert word in text


@pytest.mark.parametrize(
    "arguments", [[], ["comparee"], ["compare", "--sedes", "2"], ["compare", "--seeds", "two"]]
)
def test_what_is_no_command_is_refused(
    arguments: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as stop:
        main(arguments)
    assert stop.value.code == 2
    assert "Traceback" not in capsys.readouterr().err


LOG = "{log}"  # stands for a recording that is there

REFUSED = [
    (["--estimators", "dead-reckonin"], "no estimator is named 'dead-reckonin'; did you mean"),
    (["--log", "nowhere"], "nowhere is missing or is not a folder"),
    (["--log", LOG, "--world", "yard"], "--world and --log exclude each other: give one"),
    (["--log", LOG, "--estimators", "dead-reckoning"], "needs odometry or tracks, which log"),
    (["--log", LOG, "--driver", "straight"], "--driver has no effect on a recording: leave it out"),
    (["--log", LOG, "--steps", "99"], "--steps 99 is too many: "),
    (["--world", "moon"], "moon"),
    (["--driver", "backwards"], "no driver 'backwards'; there are: straight, spot-turn, figure-"),
    (["--seeds", "0"], "--seeds must be at least 1, got 0"),
    (["--steps", "0"], "--steps must be at least 1, got 0"),
    (["--resume"], "--resume needs --output: the folder of the results to complete"),
    (["--camera-x", "1"], "describe the camera of a recording and need --log; a world knows"),
]


@pytest.mark.parametrize(("arguments", "words"), REFUSED)
def test_misuse_is_refused_in_one_line(
    arguments: list[str],
    words: str,
    tmp_path: Path,
    wall_log: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    filled = [argument.format(log=wall_log) for argument in arguments]
    assert main(["compare", *filled]) == 2
    error = capsys.readouterr().err
    assert error.startswith("grouser compare: error: ")
    assert words in error
    assert error.count("\n") == 1
    assert not list(tmp_path.iterdir()), "nothing was begun"


def test_results_are_not_mixed(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    common = ["compare", "--estimators", "ground-truth", "--no-plots", "--output", str(tmp_path)]
    assert main([*common, "--steps", "3"]) == 0
    assert main([*common, "--steps", "3"]) == 2
    assert "already holds results; give --resume" in capsys.readouterr().err
    assert main([*common, "--steps", "4", "--resume"]) == 2
    assert "was begun with other settings: steps 3 (now 4)" in capsys.readouterr().err


def test_missing_matplotlib_is_told_before_the_work(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(plots, "find_spec", lambda name: None)
    assert main(["compare", "--output", str(tmp_path / "a")]) == 2
    assert 'pip install "grouser[plot]", or give --no-plots' in capsys.readouterr().err


def test_a_bug_is_not_taken_for_a_misuse(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A ValueError of the work itself must keep its traceback."""
    from grouser.scripts import compare_work

    def broken(*arguments: object, **options: object) -> None:
        raise ValueError("a bug")

    monkeypatch.setattr(compare_work, "execute", broken)
    with pytest.raises(ValueError, match="a bug"):
        main(["compare", "--estimators", "ground-truth", "--output", str(tmp_path / "a")])


def test_an_interruption_before_the_work_is_no_traceback(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    from grouser.scripts import compare_work

    def interrupted(options: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(compare_work, "prepare", interrupted)
    assert main(["compare"]) == 130
    assert capsys.readouterr().err == "grouser compare: interrupted\n"


def test_the_installed_command_refuses_without_a_traceback() -> None:
    command = [sys.executable, "-m", "grouser.scripts.cli", "compare", "--estimators", "nope"]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 2
    assert done.stdout == ""
    assert done.stderr.startswith("grouser compare: error: no estimator is named 'nope'")
    assert "Traceback" not in done.stderr


def test_without_a_terminal_there_is_no_progress_bar(tmp_path: Path, wall_log: Path) -> None:
    command = [sys.executable, "-m", "grouser.scripts.cli", "compare", "--log", str(wall_log)]
    options = ["--estimators", "ground-truth", "--no-plots", "--output", str(tmp_path / "a")]
    done = subprocess.run([*command, *options], capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, "")
    assert "log:wall, 15 steps" in done.stdout
    assert "\x1b" not in done.stdout, "no colour codes in a file"


def test_help_does_not_wait_for_what_only_the_work_needs() -> None:
    """Physics, kernels and statistics take seconds to import."""
    shown = (
        "import sys; from grouser.scripts.cli import main; main(['--version']); print(*sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", shown], capture_output=True, text=True, check=True)
    imported = set(done.stdout.split())
    assert "tyro" in imported
    assert not imported & {"numba", "scipy", "cv2", "pybullet", "grouser.envs.simulation"}
