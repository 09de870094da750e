"""`grouser watch` shows an episode in a file, and says how it ended."""

from pathlib import Path

import cv2
import numpy as np
import pytest

from grouser.agents.episode import Trial, run_trial
from grouser.envs.simulation.worlds.registry import make_world
from grouser.geometry import between
from grouser.scripts.cli import main
from grouser.scripts.watch_top_view import TopView

SHORT = ["--policy", "straight", "--estimator", "ground-truth", "--dynamics", "fast"]


def run(*arguments: object) -> int:
    return main(["watch", *map(str, arguments)])


def test_a_video_has_a_frame_a_step(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(*SHORT, "--seed", 0, "--output", tmp_path / "drive.mp4") == 0
    task = {"world": "depot", "robot": {"dynamics": "fast"}}
    driven = run_trial(Trial("straight", "ground-truth", 0, task))
    video = cv2.VideoCapture(str(tmp_path / "drive.mp4"))
    assert video.get(cv2.CAP_PROP_FRAME_COUNT) == round(driven.time_s / 0.1)
    assert video.get(cv2.CAP_PROP_FPS) == pytest.approx(10.0)
    said = " ".join(capsys.readouterr().out.split())
    assert f"straight on ground-truth, seed 0: {driven.outcome}" in said


def test_a_picture_shows_the_end(tmp_path: Path) -> None:
    assert run(*SHORT, "--output", tmp_path / "drive.png") == 0
    picture = cv2.imread(str(tmp_path / "drive.png"))
    assert picture is not None and picture.shape[0] == 480 and picture.shape[1] > 640


def test_courses_are_drawn_where_they_were() -> None:
    world = make_world("yard", np.random.default_rng(0))
    view, goal = TopView(world), np.array([1.0, 0.0])
    bare = view.picture(goal, height=400)
    for ahead in np.linspace(0, 1.5, 10):
        view.move(np.array([ahead, 0.0, 0.0]), np.array([ahead, ahead / 2, 0.0]))
    drawn = view.picture(goal, height=400)
    changed = np.argwhere((drawn != bare).any(axis=-1))
    space = view._space
    scale = 400 / space.free.shape[0]
    up = (399 - changed[:, 0]) / scale * space.cell + space.origin[1]
    along = changed[:, 1] / scale * space.cell + space.origin[0]
    x, y, _ = between(world.start, np.column_stack([along, up, np.zeros(len(up))])).T
    assert -0.15 < x.min() < 0.1 and 1.4 < x.max() < 1.65
    assert -0.15 < y.min() < 0.0 and 0.65 < y.max() < 0.9


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--output", "drive.gif"], "a file is .mp4, .avi (a video) or .png"),
        (["--output", "/nowhere/drive.mp4"], "there is no folder /nowhere; make it first"),
        (["--policy", "pursiut", "--output", "a.png"], "no driver is named 'pursiut'"),
    ],
)
def test_misuse_is_refused(
    options: list[str], message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(*options) == 2
    assert message in " ".join(capsys.readouterr().err.split())
