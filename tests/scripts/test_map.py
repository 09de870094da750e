"""`grouser map`: what it writes, finding the way by what it wrote, and what it refuses."""

from pathlib import Path
from shutil import copytree

import cv2
import numpy as np
import pytest

from grouser.envs.plane.world import make_plane_world
from grouser.estimators import registry
from grouser.estimators.line_slam.lines import line_through
from grouser.estimators.line_slam.map_file import load_line_map
from grouser.geometry import wrap
from grouser.scripts.cli import main
from grouser.scripts.scan_keeper import ScanKeeper
from grouser.trajectory import read_tum

pytest.importorskip("matplotlib", reason="matplotlib is not installed: pip install -e '.[plot]'")

NAME = "simple-mapper"


@pytest.fixture(autouse=True)
def mapper(monkeypatch: pytest.MonkeyPatch) -> None:
    spec = registry.EstimatorSpec(NAME, "tests.scripts.simple_mapper:SimpleMapper", {})
    monkeypatch.setitem(registry._registry, NAME, spec)


def run(*arguments: str | Path) -> int:
    return main(["map", "--estimator", NAME, *map(str, arguments)])


def test_a_plane_is_mapped_and_the_map_is_there_as_file_picture_and_poses(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run("--steps", "1000", "--seed", "1", "--output", tmp_path / "made") == 0
    line_map = load_line_map(tmp_path / "made" / "map.geojson")
    told = capsys.readouterr().out
    assert f"a map of {len(line_map)} lines" in told and "75.0 m driven" in told
    world = make_plane_world("yan-normal")
    truth = world.segments_from_start
    true_lines = line_through(truth[:, :2], truth[:, 2:])
    for line in line_map.lines:
        # A line is the same with its normal turned round.
        turned = np.array([line, [-line[0], wrap(line[1] + np.pi)]])
        away = np.abs(wrap(turned[:, None, 1] - true_lines[:, 1]))
        apart = np.abs(turned[:, None, 0] - true_lines[:, 0])
        assert ((away < 0.3) & (apart < 5.0)).any()
    image = cv2.imread(str(tmp_path / "made" / "map.png"))
    assert image is not None and len(np.unique(image.reshape(-1, 3), axis=0)) > 50
    poses = read_tum(tmp_path / "made" / "poses.tum")
    true_poses = read_tum(tmp_path / "made" / "truth.tum")
    assert len(poses.stamps) == 1001 and poses.covariances is not None
    np.testing.assert_array_equal(poses.stamps, true_poses.stamps)
    assert np.linalg.norm(poses.poses[-1, :2, 3] - true_poses.poses[-1, :2, 3]) < 10


def test_the_way_by_a_map_leaves_the_map_as_it_is(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    run("--steps", "200", "--output", tmp_path / "made")
    made = tmp_path / "made" / "map.geojson"
    assert run("--steps", "100", "--map", made, "--output", tmp_path / "again") == 0
    assert (tmp_path / "again" / "map.geojson").read_bytes() == made.read_bytes()
    assert "the way by" in capsys.readouterr().out


def test_the_way_by_a_map_is_no_worse_than_the_way_of_mapping_and_leaves_it_as_it_is(
    tmp_path: Path,
) -> None:
    """The map is of another seed than the ways, which are of the same."""

    def slam(*arguments: str | Path) -> int:
        return main(["map", "--estimator", "ekf-line-slam", *map(str, arguments)])

    def rms(folder: Path) -> float:
        poses, truth = (read_tum(folder / f"{name}.tum").poses for name in ("poses", "truth"))
        return float(np.sqrt(np.mean(np.sum((poses - truth)[:, :2, 3] ** 2, axis=1))))

    assert slam("--seed", "100", "--output", tmp_path / "known") == 0
    made = tmp_path / "known" / "map.geojson"
    mapping, finding = [], []
    for seed in ("1", "2", "3"):
        slam("--seed", seed, "--output", tmp_path / f"made{seed}")
        slam("--seed", seed, "--map", made, "--output", tmp_path / f"found{seed}")
        assert load_line_map(tmp_path / f"found{seed}" / "map.geojson") == load_line_map(made)
        mapping.append(rms(tmp_path / f"made{seed}"))
        finding.append(rms(tmp_path / f"found{seed}"))
    assert np.mean(finding) <= np.mean(mapping)


def test_what_a_lidar_hit_lies_on_the_walls_whichever_poses_it_was_seen_from() -> None:
    from grouser.scripts.plane_source import Plane

    source = Plane("yan-normal", lidar=True)
    env = ScanKeeper(source.make(["lidar"]))
    poses = [env.reset(seed=0)[1]["true_pose"]]
    drive = source.drive(400)
    for step in range(400):
        action = drive(step)
        assert action is not None
        poses.append(env.step(action.astype(np.float32))[4]["true_pose"])
    points = env.points(np.array(poses))
    segments = source.segments.reshape(-1, 2, 2)
    lines = line_through(segments[:, 0], segments[:, 1])
    normal = np.stack([np.cos(lines[:, 1]), np.sin(lines[:, 1])])
    off = np.abs(points @ normal - lines[:, 0]).min(axis=1)
    assert len(points) > 1000 and np.median(off) < 0.05 and off.max() < 1.0


def test_a_recording_is_replayed_and_without_poses_has_no_truth(
    tmp_path: Path, wall_log: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run("--log", wall_log, "--output", tmp_path / "known") == 0
    assert (tmp_path / "known" / "truth.tum").exists() and "ATE" in capsys.readouterr().out
    blind = copytree(wall_log, tmp_path / "blind")
    (blind / "poses.txt").unlink()
    assert run("--log", blind, "--output", tmp_path / "unknown") == 0
    assert not (tmp_path / "unknown" / "truth.tum").exists()
    told = capsys.readouterr().out
    assert "ATE" not in told and "truth.tum" not in told


@pytest.mark.parametrize("source", [["--lidar"], ["--world", "corridor"]])
def test_with_a_lidar_the_picture_shows_scans(source: list[str], tmp_path: Path) -> None:
    assert run(*source, "--steps", "20", "--output", tmp_path / "made") == 0
    assert (tmp_path / "made" / "map.png").stat().st_size > 10_000


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--world", "yan-norma"], "yan-norma"),
        (["--world", "yard", "--lidar"], "--lidar is for yan-normal and yan-over-range"),
        (["--log", "somewhere", "--world", "yard"], "exclude --log"),
        (["--map", "nowhere.geojson"], "nowhere.geojson"),
        (["--sigmas", "0"], "--sigmas must be a positive number"),
        (["--steps", "0"], "--steps must be at least 1"),
        (["--options", "paper"], "is not NAME=VALUE"),
        (["--options", "papper=true"], "unexpected keyword argument 'papper'"),
    ],
)
def test_what_cannot_be_mapped_is_refused_in_one_line(
    arguments: list[str], words: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(*arguments, "--output", tmp_path / "made") == 2
    told = capsys.readouterr().err
    assert words in told and told.count("\n") == 1
    assert not (tmp_path / "made").exists()


def test_who_makes_no_map_of_lines_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["map", "--estimator", "ground-truth"]) == 2
    told = capsys.readouterr().err
    assert "ground-truth makes no map of lines; these do: ekf-line-slam" in told and NAME in told


def test_help_teaches(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        main(["map", "--help"])
    text = " ".join(capsys.readouterr().out.replace("│", " ").split())
    for word in ("--world", "--log", "--map", "--sigmas", "yan-over-range --map over/map.geojson"):
        assert word in text
