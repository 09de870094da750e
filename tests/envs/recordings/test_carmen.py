"""CARMEN logs: what is read of them, and the words for lines that are broken."""

from pathlib import Path

import numpy as np
import pytest

from grouser.envs.recordings.carmen import open_carmen
from grouser.envs.recordings.lidar_log import growing_stamps
from grouser.geometry import between, project
from tests.envs.recordings.small_logs import (
    BEAMS,
    SEEN,
    STEP,
    N,
    carmen_lines,
    poses,
    ranges,
    write_carmen,
)


def test_scans_and_odometry_are_read_in_the_order_of_their_lines(tmp_path: Path) -> None:
    log = open_carmen(write_carmen(tmp_path))
    assert (len(log), log.sensors) == (N, ("lidar", "odometry"))
    np.testing.assert_array_equal(log.increments["odometry"][0], np.zeros(3))
    np.testing.assert_allclose(log.increments["odometry"][1:], np.tile(STEP, (N - 1, 1)), atol=3e-6)
    np.testing.assert_allclose(log.stamps, 2.0 * np.arange(N))
    assert log.rig.dt == 2.0


def test_the_rig_says_how_the_lidar_is_mounted_and_how_far_it_sees(tmp_path: Path) -> None:
    log = open_carmen(write_carmen(tmp_path))
    lidar = log.rig.lidar
    assert lidar is not None and log.rig.odometry is not None and log.rig.tracks is None
    np.testing.assert_allclose(np.degrees(lidar.bearings), np.arange(BEAMS) - 90.0)
    np.testing.assert_allclose(project(lidar.T_base_lidar), [0.2, 0.0, 0.0])
    assert lidar.range_max == 80
    scan = log.read("lidar", 4, log.rig, color=False)
    assert scan.dtype == np.float32 and scan[3] == 80, "81.83 m is no return"
    eye = poses(SEEN)[4] + [0.2 * np.cos(poses(SEEN)[4, 2]), 0.2 * np.sin(poses(SEEN)[4, 2]), 0.0]
    expected = ranges(eye, lidar.bearings)
    np.testing.assert_allclose(np.delete(scan, 3), np.delete(expected, 3), atol=1e-3)


@pytest.mark.parametrize(
    ("beams", "step_degrees"), [(180, 1.0), (181, 1.0), (360, 0.5), (361, 0.5)]
)
def test_beams_are_spread_over_half_a_turn(tmp_path: Path, beams: int, step_degrees: float) -> None:
    scan = " ".join(["2.0"] * (beams - 1) + ["3.0"])
    lines = [f"FLASER {beams} {scan} 0 0 0 {k} 0 0 {k} host {k}" for k in (1, 2)]
    lidar = open_carmen(write_carmen(tmp_path, lines, reference=False)).rig.lidar
    assert lidar is not None and lidar.n_beams == beams
    assert np.degrees(lidar.angle_min) == -90
    assert np.degrees(lidar.angle_increment) == pytest.approx(step_degrees)


def test_reference_poses_are_those_of_the_start(tmp_path: Path) -> None:
    log = open_carmen(write_carmen(tmp_path))
    base = log.base_poses(log.rig)
    assert base is not None
    truth = poses(SEEN)
    np.testing.assert_allclose(project(base), between(truth[0], truth), atol=1e-9)
    (tmp_path / "room_ref.tum").unlink()
    assert open_carmen(tmp_path / "room.log").base_poses(log.rig) is None


def test_a_lidar_that_ends_nearer_is_found_out(tmp_path: Path) -> None:
    """Some logs say 50 m where nothing came back, whatever their parameter says."""
    lines = [line.replace("81.830", "50.0") for line in carmen_lines()]
    log = open_carmen(write_carmen(tmp_path, lines))
    assert log.rig.lidar is not None and log.rig.lidar.range_max == 50
    assert log.read("lidar", 0, log.rig, color=False)[3] == 50
    told = ["PARAM robot_front_laser_max 7.5 0 host 0", *carmen_lines()]
    log = open_carmen(write_carmen(tmp_path, told))
    assert log.rig.lidar is not None and log.rig.lidar.range_max == 7.5
    assert log.read("lidar", 0, log.rig, color=False).max() == 7.5


def test_stamps_that_run_backwards_are_ordered_by_line(tmp_path: Path) -> None:
    lines = [line.replace("18.5 host 18.6", "3.0 host 3.1") for line in carmen_lines()]
    log = open_carmen(write_carmen(tmp_path, lines))
    assert (np.diff(log.stamps) > 0).all()
    np.testing.assert_allclose(log.increments["odometry"][1:], np.tile(STEP, (N - 1, 1)), atol=3e-6)
    stamps, usual = growing_stamps(np.array([5.0, 6.0, 8.0, 2.0, 4.0, 4.0]))
    assert usual == 2
    np.testing.assert_allclose(stamps, [0, 1, 3, 5, 7, 9])


def test_messages_of_other_sensors_are_passed_over(tmp_path: Path) -> None:
    others = ["", "SYNC start", "RLASER 2 1 1 0 0 0 0 0 0 1 host 1", "NMEAGGA 1 2 3", "TRUEPOS 0 0"]
    log = open_carmen(write_carmen(tmp_path, [*others, *carmen_lines()]))
    assert len(log) == N


@pytest.mark.parametrize(
    ("line", "was", "becomes", "words"),
    [
        (3, " host", " ho st", r"room.log:3: FLASER is a line of 191 words here, found 192"),
        (5, "FLASER 180", "FLASER 181", r":5: FLASER of 181 readings; expected 180, as in the fir"),
        (3, "FLASER 180", "FLASER x", r":3: number of readings of FLASER: expected 1 numbers, but"),
        (3, "FLASER 180", "FLASER 1.5", r":3: FLASER of 1.5 readings; expected a whole number abo"),
        (5, " 81.830", " -4", r":5: FLASER reads a negative range, -4 m"),
        (5, " 81.830", " nan", r":5: FLASER: expected 188 finite numbers, found"),
        (7, " 81.830", " 8l.8", r":7: FLASER: expected 188 numbers, but could not convert string"),
        (7, "FLASER", "FLASR", r":7: 'FLASR' is no message of a CARMEN log; did you mean 'FLASER'"),
        (
            7,
            "FLASER 180",
            "",
            r":7: '\d.*' is no message of a CARMEN log; a line begins with FLASE",
        ),
        (4, "ODOM", "ODOM 1", r":4: ODOM is a line of 10 words here, found 11: is it cut short"),
        (4, "0.5", "0.5x", r":4: ODOM: expected 8 numbers, but could not convert string to float"),
        (2, " 0.2 0 host 0", "", r":2: PARAM robot_frontlaser_offset: expected 1 numbers, fo"),
    ],
)
def test_a_broken_line_is_refused_with_its_place(
    tmp_path: Path, line: int, was: str, becomes: str, words: str
) -> None:
    lines = carmen_lines()
    assert was in lines[line - 1]
    lines[line - 1] = lines[line - 1].replace(was, becomes, 1)
    with pytest.raises(ValueError, match=words):
        open_carmen(write_carmen(tmp_path, lines))


def test_a_log_cut_short_is_refused(tmp_path: Path) -> None:
    whole = write_carmen(tmp_path).read_text()
    path = tmp_path / "room.log"
    path.write_text(whole[: whole.rindex("FLASER") + 200])
    with pytest.raises(ValueError, match=r"room.log:25: FLASER is a line of 191 words here, found"):
        open_carmen(path)
    path.write_text("ODOM 0 0 0 0 0 0 1 host 1\n")
    with pytest.raises(ValueError, match=r"room.log:1: the log ends after 0 FLASER scans; a recor"):
        open_carmen(path)
    path.write_bytes(b"FLASER \xff\xfe")
    with pytest.raises(ValueError, match=r"room.log is not a text file"):
        open_carmen(path)


def test_reference_poses_of_other_scans_are_refused(tmp_path: Path) -> None:
    path = write_carmen(tmp_path)
    reference = (tmp_path / "room_ref.tum").read_text().splitlines()
    (tmp_path / "room_ref.tum").write_text("\n".join(reference[:-1]))
    with pytest.raises(
        ValueError, match=r"room_ref.tum: its first column must be the number of the scan, 0 to 11"
    ):
        open_carmen(path)
    (tmp_path / "room_ref.tum").write_text("\n".join([*reference[:-1], "11 0 0 0"]))
    with pytest.raises(ValueError, match=r"room_ref.tum:13: expected 8 numbers, found 4 entries"):
        open_carmen(path)
