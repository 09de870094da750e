"""The calibration: exact on disk, frozen in memory, and clear about what it refuses."""

import copy
import dataclasses
import pickle
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from grouser import geometry
from grouser.rig import (
    R_BASE_OPTICAL,
    Gps,
    Imu,
    Lidar,
    Rig,
    StereoCamera,
    TrackGeometry,
    camera_mount,
)
from grouser.rig_motion import LineSensor, Odometry, Steering

TRACKS = TrackGeometry(gauge=0.40, width=0.08, effective_width=0.55)
STEREO = StereoCamera(
    fx=260.1,
    fy=260.2,
    cx=159.3,
    cy=119.7,
    baseline=0.12,
    width=320,
    height=240,
    T_base_camera=camera_mount(0.15, 0.05, 0.3, pitch=0.17),
    mount_sigma=np.full(6, 0.002),
)
LIDAR = Lidar(360, -np.pi, np.pi / 180, 0.1, 30.0, 0.02, 0.0015, geometry.lift([0.1, 0.0, 0.0]))
RIG = Rig(dt=0.1, tracks=TRACKS, stereo=STEREO, lidar=LIDAR, imu=Imu(0.05, 0.002), gps=Gps(0.5))
STEERING = Steering(
    wheelbase=4.0,
    max_speed=3.0,
    max_angle=0.52,
    max_angle_rate=0.35,
    sigma_speed=0.3,
    sigma_angle=0.05,
)
SENSOR = LineSensor(range_max=30.0, sigma_range=0.1, sigma_bearing=0.017, max_lines=8)


def test_yaml_gives_the_same_rig_back(tmp_path: Path) -> None:
    lines = Rig(dt=0.025, steering=STEERING, odometry=Odometry(), line_sensor=SENSOR)
    for rig in (RIG, lines, Rig(dt=1 / 3), Rig(dt=1e-5, tracks=TRACKS)):
        rig.to_yaml(tmp_path / "rig.yaml")
        assert Rig.from_yaml(tmp_path / "rig.yaml") == rig


@given(
    dt=st.floats(1e-12, 1e12),
    gauge=st.floats(1e-300, 1e300),
    offset=st.floats(allow_nan=False, allow_infinity=False),
)
def test_yaml_keeps_every_bit(
    tmp_path_factory: pytest.TempPathFactory, dt: float, gauge: float, offset: float
) -> None:
    stereo = dataclasses.replace(STEREO, disparity_offset=offset)
    rig = Rig(dt=dt, tracks=TrackGeometry(gauge, 0.1, gauge), stereo=stereo)
    path = tmp_path_factory.getbasetemp() / "rig.yaml"
    rig.to_yaml(path)
    assert Rig.from_yaml(path) == rig


@pytest.mark.parametrize("copied", [copy.deepcopy, lambda rig: pickle.loads(pickle.dumps(rig))])
def test_a_rig_and_its_copies_are_equal_hashable_and_read_only(copied) -> None:  # type: ignore[no-untyped-def]
    twin = copied(RIG)
    assert twin == RIG and hash(twin) == hash(RIG)
    for array in (twin.stereo.T_base_camera, twin.stereo.mount_sigma, twin.lidar.T_base_lidar):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 1.0
    with pytest.raises(dataclasses.FrozenInstanceError):
        twin.dt = 0.2


def test_a_rig_keeps_its_own_copy_of_a_mount() -> None:
    mount = camera_mount(0.15)
    stereo = dataclasses.replace(STEREO, T_base_camera=mount)
    mount[0, 3] = 9.0
    assert stereo.T_base_camera[0, 3] == 0.15


def test_rigs_that_differ_in_one_entry_of_a_mount_differ() -> None:
    other = RIG.with_overrides({"stereo.T_base_camera": camera_mount(0.15, 0.05, 0.31, pitch=0.17)})
    assert other != RIG
    assert RIG.lidar is not None
    assert RIG.lidar != dataclasses.replace(RIG.lidar, T_base_lidar=np.eye(4))


def test_a_level_camera_looks_forward_and_a_positive_pitch_looks_down() -> None:
    assert np.array_equal(camera_mount(1.0, 2.0, 3.0)[:3, :3], R_BASE_OPTICAL)
    forward, down = camera_mount(pitch=0.1)[[0, 2], 2]
    assert forward == pytest.approx(np.cos(0.1)) and down == pytest.approx(-np.sin(0.1))
    assert np.allclose(STEREO.T_base_camera @ STEREO.T_camera_base, np.eye(4), atol=1e-15)


def test_lidar_bearings_start_at_the_first_beam() -> None:
    assert LIDAR.bearings.shape == (360,)
    assert LIDAR.bearings[0] == -np.pi
    assert LIDAR.bearings[180] == pytest.approx(0.0, abs=1e-12)


def test_overrides_replace_values_parts_and_nothing_else() -> None:
    overrides = {"stereo.baseline": 0.5, "tracks": None, "dt": 0.05}
    rig = RIG.with_overrides(overrides)
    assert rig.stereo is not None and rig.stereo.baseline == 0.5
    assert rig.tracks is None and rig.dt == 0.05
    assert rig.lidar == RIG.lidar and rig.stereo.T_base_camera is not None
    assert RIG.stereo is not None and RIG.stereo.baseline == 0.12


@pytest.mark.parametrize("name", ["stereo.base_line", "camera.fx", "radar", "", "dt.x", "imu."])
def test_an_unknown_override_lists_the_allowed_names(name: str) -> None:
    with pytest.raises(ValueError) as refused:
        RIG.with_overrides({name: 1.0})
    message = str(refused.value)
    assert (
        f"the rig has no {name!r} to override; it has: dt, gps, gps.sigma_position, imu, imu.sigma"
        in message
    )
    assert "stereo.baseline" in message


def test_an_override_of_a_part_that_the_rig_lacks_is_refused() -> None:
    with pytest.raises(ValueError, match=r"the rig has no 'stereo\.fx' to override"):
        Rig(dt=0.1).with_overrides({"stereo.fx": 200.0})


@pytest.mark.parametrize("value", [0.0, -0.1, np.nan, np.inf])
def test_lengths_must_be_positive(value: float) -> None:
    with pytest.raises(ValueError, match="StereoCamera.baseline must be positive, got"):
        dataclasses.replace(STEREO, baseline=value)
    with pytest.raises(ValueError, match="Rig.dt must be positive, got"):
        Rig(dt=value)
    with pytest.raises(ValueError, match="TrackGeometry.effective_width must be positive, got"):
        TrackGeometry(0.4, 0.08, value)


def test_a_word_is_no_length() -> None:
    with pytest.raises(ValueError, match="StereoCamera.fx must be positive, got 'wide'"):
        RIG.with_overrides({"stereo.fx": "wide"})


@pytest.mark.parametrize("name", ["cx", "cy", "disparity_offset"])
@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_calibrated_values_must_be_finite(name: str, value: float) -> None:
    with pytest.raises(ValueError, match=f"StereoCamera.{name} must be finite, got {value}"):
        RIG.with_overrides({f"stereo.{name}": value})


@pytest.mark.parametrize(
    "name", ["stereo.disparity_sigma", "lidar.sigma_range", "imu.sigma_rate", "gps.sigma_position"]
)
@pytest.mark.parametrize("value", [-0.1, np.nan, np.inf])
def test_sigmas_must_be_zero_or_more(name: str, value: float) -> None:
    with pytest.raises(ValueError, match=f"{name.partition('.')[2]} must be zero or more, got"):
        RIG.with_overrides({name: value})
    with pytest.raises(ValueError, match=r"StereoCamera\.mount_sigma must be"):
        dataclasses.replace(STEREO, mount_sigma=np.full(6, value))


@pytest.mark.parametrize("value", [0, -1, 320.5, 320.0, "320"])
def test_pixels_and_beams_are_counted(value: Any) -> None:
    with pytest.raises(ValueError, match="StereoCamera.width must be a positive whole number, got"):
        dataclasses.replace(STEREO, width=value)
    with pytest.raises(ValueError, match="Lidar.n_beams must be a positive whole number, got"):
        dataclasses.replace(LIDAR, n_beams=value)


def test_a_lidar_reads_farther_than_its_nearest() -> None:
    with pytest.raises(ValueError, match=r"range_min must be less than range_max, 30.0 m, got 30"):
        dataclasses.replace(LIDAR, range_min=30.0)


def test_a_part_must_be_of_its_kind() -> None:
    with pytest.raises(ValueError, match="Rig.tracks must be a TrackGeometry or None, got 0.4"):
        RIG.with_overrides({"tracks": 0.4})


def test_a_mount_must_be_a_finite_rigid_transform() -> None:
    with pytest.raises(ValueError, match=r"T_base_camera must have shape \(4, 4\), got \(3, 3\)"):
        dataclasses.replace(STEREO, T_base_camera=np.eye(3))
    with pytest.raises(ValueError, match="T_base_lidar must be finite, got"):
        dataclasses.replace(LIDAR, T_base_lidar=np.full((4, 4), np.nan))
    mirrored = np.diag([1.0, -1.0, 1.0, 1.0])
    for wrong in (mirrored, 2 * np.eye(4), np.eye(4)[::-1]):
        with pytest.raises(ValueError, match="T_base_camera must be a rigid transform"):
            dataclasses.replace(STEREO, T_base_camera=wrong)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("tracks: {gauge: 0.4}\ndt: 0.1", "width"),
        ("dt: 0.1\nradar: {}", r"unknown entries \['radar'\]"),
        ("tracks: null", "'dt'"),
        ("", "NoneType"),
        ("dt: [", "parsing"),
        ("dt: fast", "dt"),
    ],
)
def test_a_file_that_is_no_rig_is_refused_by_name(tmp_path: Path, text: str, words: str) -> None:
    path = tmp_path / "rig.yaml"
    path.write_text(text)
    with pytest.raises(ValueError, match=words) as refused:
        Rig.from_yaml(path)
    assert f"{path} is not a rig" in str(refused.value)
    assert "expected dt, tracks, stereo, lidar, imu, gps" in str(refused.value)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: dataclasses.replace(STEERING, wheelbase=0.0), "wheelbase must be positive"),
        (lambda: dataclasses.replace(STEERING, max_angle=1.6), "less than a quarter turn, got 1.6"),
        (lambda: Odometry(heading=-1.0), "heading must be zero or more, got -1.0"),
        (lambda: dataclasses.replace(SENSOR, max_lines=0), "positive whole number, got 0"),
    ],
)
def test_parts_for_lines_and_steering_refuse_nonsense(make: Any, words: str) -> None:
    with pytest.raises(ValueError, match=words):
        make()
