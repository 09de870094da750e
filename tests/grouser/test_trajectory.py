"""Trajectories survive the disk, evo reads them, and malformed ones are named by file and line."""

from pathlib import Path

import numpy as np
import pytest
from evo.tools import file_interface

from grouser.geometry import Array, rotation_from_rpy, transform
from grouser.trajectory import Trajectory, read_kitti, read_tum, write_kitti, write_tum

N = 12


@pytest.fixture
def poses() -> Array:
    rng = np.random.default_rng(0)
    rotations = [rotation_from_rpy(*angles) for angles in rng.uniform(-1.5, 1.5, (N, 3))]
    return transform(np.array(rotations), rng.normal(0, 5, (N, 3)))


@pytest.fixture
def covariances() -> Array:
    roots = np.random.default_rng(1).normal(0, 0.1, (N, 3, 3))
    return np.asarray(roots @ roots.transpose(0, 2, 1))


STAMPS = np.linspace(0.0, 0.1 * (N - 1), N)


def test_tum_survives_the_disk(tmp_path: Path, poses: Array, covariances: Array) -> None:
    path = tmp_path / "a.tum"
    write_tum(path, Trajectory(STAMPS, poses, covariances))
    found = read_tum(path)
    assert found.covariances is not None
    np.testing.assert_allclose(found.stamps, STAMPS, atol=1e-9)
    np.testing.assert_allclose(found.poses, poses, atol=1e-9)
    np.testing.assert_allclose(found.covariances, covariances, rtol=1e-9)


def test_tum_keeps_the_milliseconds_of_a_clock(tmp_path: Path, poses: Array) -> None:
    stamps = 1317384506.404 + STAMPS
    write_tum(tmp_path / "a.tum", Trajectory(stamps, poses))
    np.testing.assert_allclose(read_tum(tmp_path / "a.tum").stamps - stamps, 0, atol=1e-6)


def test_tum_without_covariance_has_none(tmp_path: Path, poses: Array) -> None:
    write_tum(tmp_path / "a.tum", Trajectory(STAMPS, poses))
    assert read_tum(tmp_path / "a.tum").covariances is None


def test_kitti_survives_the_disk(tmp_path: Path, poses: Array) -> None:
    write_kitti(tmp_path / "a.txt", poses)
    np.testing.assert_allclose(read_kitti(tmp_path / "a.txt"), poses, atol=1e-9)


def test_kitti_makes_rounded_rotations_exact(tmp_path: Path, poses: Array) -> None:
    np.savetxt(tmp_path / "a.txt", poses[:, :3].reshape(N, 12), fmt="%.3e")
    R = read_kitti(tmp_path / "a.txt")[:, :3, :3]
    np.testing.assert_allclose(R @ R.transpose(0, 2, 1), np.tile(np.eye(3), (N, 1, 1)), atol=1e-12)


def test_evo_reads_both(tmp_path: Path, poses: Array) -> None:
    write_tum(tmp_path / "a.tum", Trajectory(STAMPS, poses))
    write_kitti(tmp_path / "a.txt", poses)
    tum = file_interface.read_tum_trajectory_file(str(tmp_path / "a.tum"))
    kitti = file_interface.read_kitti_poses_file(str(tmp_path / "a.txt"))
    np.testing.assert_allclose(tum.timestamps, STAMPS, atol=1e-9)
    np.testing.assert_allclose(tum.poses_se3, poses, atol=1e-9)
    np.testing.assert_allclose(kitti.poses_se3, poses, atol=1e-9)


IDENTITY = "1 0 0 0 0 1 0 0 0 0 1 0"


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (f"{IDENTITY}\n1 0 0\n", r"poses.txt:2: expected 12 numbers, found 3 entries"),
        (f"{IDENTITY}\n\n{IDENTITY.replace('1', 'x', 1)}\n", r"poses.txt:3: expected 12 numbers"),
        (IDENTITY.replace("0", "nan", 1), r"poses.txt:1: expected 12 finite numbers"),
        (IDENTITY.replace("1", "2", 1), r"poses.txt:1: the first three columns .* no rotation"),
        (IDENTITY.replace("1", "-1", 1), r"poses.txt:1: the first three columns .* no rotation"),
        ("# nothing\n", r"poses.txt:1: the file holds no row of numbers"),
    ],
)
def test_malformed_kitti_is_refused(tmp_path: Path, text: str, words: str) -> None:
    (tmp_path / "poses.txt").write_text(text)
    with pytest.raises(ValueError, match=words):
        read_kitti(tmp_path / "poses.txt")


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("0 1 2 3 0 0 0 1\n0 1 2 3 0 0 0 2\n", r"a.tum:2: the quaternion .* has length 2, not 1"),
        ("0 1 2 3 0 0 0 1\n" + "0 " * 14, r"a.tum:2: expected 8 numbers, found 14 entries"),
        ("0 1 2 3", r"a.tum:1: expected 8 or 14 numbers, found 4 entries"),
    ],
)
def test_malformed_tum_is_refused(tmp_path: Path, text: str, words: str) -> None:
    (tmp_path / "a.tum").write_text(text)
    with pytest.raises(ValueError, match=words):
        read_tum(tmp_path / "a.tum")


def test_a_missing_or_binary_file_is_refused(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError, match=r"none.tum is missing"):
        read_tum(tmp_path / "none.tum")
    (tmp_path / "a.tum").write_bytes(b"\xff\xfe\x00\xd8")
    with pytest.raises(ValueError, match=r"a.tum is not a text file"):
        read_tum(tmp_path / "a.tum")
