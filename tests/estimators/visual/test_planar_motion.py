"""Planar motions as poses and back, with derivatives."""

import numpy as np

from grouser.estimators.visual.planar_motion import planar_pose, pose_motion, pose_to_motion
from grouser.geometry import rotate


def test_pose_and_motion_are_one_with_their_derivative() -> None:
    rng, h = np.random.default_rng(2), 1e-6
    for pose in rng.uniform(-1, 1, (20, 3)):
        turn, chord, side = motion = pose_motion(pose)
        back = np.append(rotate(turn / 2, [chord, side]), turn)
        np.testing.assert_allclose(back, pose, atol=1e-14)
        np.testing.assert_allclose(planar_pose(motion)[0], pose, atol=1e-14)
        J, to_pose = pose_to_motion(pose), planar_pose(motion)[1]
        for k in range(3):
            step = h * np.eye(3)[k]
            difference = (pose_motion(pose + step) - pose_motion(pose - step)) / (2 * h)
            assert np.abs(J[:, k] - difference).max() < 1e-9
            ahead, behind = planar_pose(motion + step)[0], planar_pose(motion - step)[0]
            assert np.abs(to_pose[:, k] - (ahead - behind) / (2 * h)).max() < 1e-9
