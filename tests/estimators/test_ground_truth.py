"""Ground truth: the true pose, seen from the first one."""

import numpy as np

from grouser import geometry
from grouser.estimators import PoseEstimate, Status, make
from grouser.geometry import Array
from grouser.rig import Rig

START = np.array([3.0, -2.0, 2.5])


def shown(pose: Array, T: Array, stamp: float) -> dict[str, Array]:
    return {"true_pose": pose, "true_pose_3d": T, "stamp": np.array([stamp])}


def test_poses_are_those_of_the_first_frame_on_the_plane_and_in_space() -> None:
    tilt = geometry.transform(geometry.rotation_from_rpy(0.05, -0.1, 0.0), [0.0, 0.0, 0.3])
    moved = np.array([0.5, 0.1, 1.2])
    later = geometry.compose(START, moved)
    estimator = make("ground-truth", Rig(dt=0.1))
    first = estimator.reset(
        shown(START, geometry.lift(START) @ tilt, 0.0), rng=np.random.default_rng(0)
    )
    last: PoseEstimate = estimator.update(shown(later, geometry.lift(later) @ tilt, 0.1))
    assert np.abs(first.pose).max() < 1e-15 and first.pose_3d is not None
    assert np.abs(first.pose_3d - np.eye(4)).max() < 1e-14
    assert np.abs(last.pose - moved).max() < 1e-14
    expected = geometry.inverse_transform(tilt) @ geometry.lift(moved) @ tilt
    assert last.pose_3d is not None and np.abs(last.pose_3d - expected).max() < 1e-13
    assert not last.covariance.any() and last.status is Status.TRACKING and last.stamp == 0.1
