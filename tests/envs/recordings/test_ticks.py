"""The file of wheel ticks and scans: its numbers as the robot's measures, its broken lines."""

from pathlib import Path

import numpy as np
import pytest

from grouser.envs.recordings.odometry_noise import with_noise
from grouser.envs.recordings.ticks import open_ticks
from grouser.geometry import Array, project
from tests.envs.recordings.small_logs import N, tick_rows, write_ticks


def test_ticks_are_ways_of_the_wheels(tmp_path: Path) -> None:
    log = open_ticks(write_ticks(tmp_path))
    assert (len(log), log.sensors, log.base_poses(log.rig)) == (N, ("lidar", "tracks"), None)
    turn = 2 * np.pi * 0.077  # m a turn of a wheel of 2000 ticks
    np.testing.assert_array_equal(log.increments["tracks"][0], [0, 0])
    np.testing.assert_allclose(
        log.increments["tracks"][1:], np.tile([0.05 * turn, 0.1 * turn], (N - 1, 1))
    )
    np.testing.assert_allclose(log.stamps, 0.1 * np.arange(N))
    assert log.rig.tracks is not None and log.rig.tracks.effective_width == 0.33


def test_the_scan_is_of_the_beams_that_do_not_see_the_robot(tmp_path: Path) -> None:
    log = open_ticks(write_ticks(tmp_path))
    lidar = log.rig.lidar
    assert lidar is not None and lidar.n_beams == 682 - 140 and lidar.range_max == 4
    np.testing.assert_allclose(project(lidar.T_base_lidar), [0.145, 0, 0])
    assert lidar.bearings[340 - 70] == pytest.approx(0)
    assert np.degrees(lidar.bearings[[0, -1]]) == pytest.approx([-94.9, 95.3], abs=0.1)
    scan = log.read("lidar", 3, log.rig, color=False)
    np.testing.assert_allclose(scan[[29, 30, 31, 32]], [1.5, 4.0, 4.0, 1.5])


def _short(rows: Array) -> str:
    return " ".join(f"{x:.0f}" for x in rows[4, :-5])


def test_a_broken_row_is_refused_with_its_place(tmp_path: Path) -> None:
    rows = tick_rows()
    path = write_ticks(tmp_path, rows)
    whole = path.read_text().splitlines()
    for bad, words in (
        (_short(rows), r"room.dat:5: expected 707 numbers, found 702 entries"),
        (whole[4].replace("1500", "15OO", 1), r"room.dat:5: expected 707 numbers, but could not"),
        (whole[4].replace("1500", "-1", 1), r"room.dat:5: the range in column 24 is negative"),
    ):
        path.write_text("\n".join([*whole[:4], bad, *whole[5:]]))
        with pytest.raises(ValueError, match=words):
            open_ticks(path)
    with pytest.raises(ValueError, match=r"room.dat:1: the file ends after one scan; a recording"):
        open_ticks(write_ticks(tmp_path, rows[:1]))


def test_the_real_robot_drives_about_45_m(exp1: Path) -> None:
    log = open_ticks(exp1)
    assert len(log) == 756
    assert np.abs(log.increments["tracks"]).sum(axis=0) == pytest.approx([45.4, 46.5], abs=0.1)


@pytest.mark.parametrize("name", ["tracks", "odometry"])
def test_noise_is_as_large_as_it_is_said_to_be(name: str) -> None:
    increment = np.array([0.4, 0.6]) if name == "tracks" else np.array([0.6, 0.8, -0.5])
    many = np.tile(increment, (40_000, 1))
    off = with_noise(name, many, 0.1, np.random.default_rng(0)) - many
    assert not off[0].any(), "at the start nothing has moved"
    expected = [0.04, 0.06] if name == "tracks" else [0.1, 0.1, np.hypot(0.1, 0.05)]
    np.testing.assert_allclose(off[1:].std(axis=0), expected, rtol=0.03)
    np.testing.assert_allclose(off[1:].mean(axis=0), 0, atol=3e-3)
