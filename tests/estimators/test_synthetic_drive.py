"""The synthetic drive agrees with its own truth, sensor by sensor."""

import numpy as np
import pytest

from grouser import geometry
from grouser.estimators import synthetic_drive as room
from grouser.estimators.synthetic_drive import RIG, synthetic_drive
from grouser.estimators.track_motion import arc_pose, track_increment

FRAMES = 8
DRIVE = synthetic_drive(frames=FRAMES, blackout=range(5, 7))


def test_tracks_add_up_to_the_true_poses() -> None:
    assert RIG.tracks is not None
    pose = np.zeros(3)
    for shown, true in zip(DRIVE.observations, DRIVE.poses, strict=True):
        step = arc_pose(*track_increment(shown["tracks"], RIG.tracks.effective_width))
        pose = geometry.compose(pose, step)
        assert np.abs(pose - true).max() < 1e-14


def test_right_image_is_the_left_one_moved_by_the_true_disparity() -> None:
    camera = RIG.stereo
    assert camera is not None
    left, right = (DRIVE.observations[0][key][..., 0].astype(float) for key in ("left", "right"))
    u, v = np.meshgrid(np.arange(camera.width), np.arange(camera.height))
    rays = np.stack([(u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy, np.ones(u.shape)])
    T = camera.T_base_camera
    depth, _ = room._hit(T[:3, 3], np.einsum("ij,jhw->hwi", T[:3, :3], rays))
    source = u - camera.fx * camera.baseline / depth
    inside = (source >= 0) & (source <= camera.width - 2)
    low = np.clip(np.floor(source).astype(int), 0, camera.width - 2)
    share = source - low
    warped = (1 - share) * right[v, low] + share * right[v, low + 1]
    difference = np.abs(warped - left)[inside]
    assert np.median(difference) < 2.5  # grey levels; the read noise is one in each image
    unmoved = np.abs(right - left)[inside]
    assert difference.mean() < 0.4 * unmoved.mean()


def test_lidar_measures_the_walls() -> None:
    assert RIG.lidar is not None
    ranges, x = DRIVE.observations[0]["lidar"], RIG.lidar.T_base_lidar[0, 3]
    assert ranges[180] == pytest.approx(room.ROOM_HIGH[0] - x, abs=0.05)  # ahead
    assert ranges[0] == pytest.approx(x - room.ROOM_LOW[0], abs=0.05)  # behind
    assert ranges[270] == pytest.approx(room.ROOM_HIGH[1], abs=0.05)  # to the left


def test_the_blackout_is_dark_where_it_was_asked_for_and_nowhere_else() -> None:
    dark = [not shown["left"].any() for shown in DRIVE.observations]
    assert dark == [False] * 5 + [True] * 2 + [False]
    assert all(
        np.isnan(shown["gps"]).all() == dark[i] for i, shown in enumerate(DRIVE.observations)
    )
    assert DRIVE.observations[5]["tracks"].any()


def test_there_is_one_truth_a_frame() -> None:
    assert len(DRIVE.observations) == len(DRIVE.truths) == len(DRIVE.poses) == FRAMES
    for truth, pose in zip(DRIVE.truths, DRIVE.poses, strict=True):
        assert np.allclose(geometry.project(truth["true_pose_3d"]), pose)
