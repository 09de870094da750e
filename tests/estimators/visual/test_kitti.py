"""On 51 frames of KITTI odometry 06, against the acceptance of the walking skeleton."""

from functools import cache
from pathlib import Path

import numpy as np
import pytest

from grouser.envs.replay import ReplayEnv
from grouser.estimators import PoseEstimate, Status, make
from grouser.estimators.evaluation.metrics import drift
from grouser.geometry import Array, lift


@cache
def replayed(log: Path, name: str) -> tuple[Array, Array, list[PoseEstimate]]:
    """True poses (51, 4, 4) and (51, 3), and the estimates."""
    env = ReplayEnv(log)
    estimator = make(name, env.rig)
    observation, info = env.reset()
    estimates = [estimator.reset(observation, rng=np.random.default_rng(0))]
    infos, ended = [info], False
    while not ended:
        observation, _, _, ended, info = env.step(np.zeros(2, dtype=np.float32))
        estimates.append(estimator.update(observation))
        infos.append(info)
    true_3d = np.array([i["true_pose_3d"] for i in infos])
    return true_3d, np.array([i["true_pose"] for i in infos]), estimates


@pytest.mark.parametrize(
    "name",
    [
        "one-point-ransac", "histogram-voting", "two-point-ransac", "three-point-ransac",
        "disparity-space", "five-point-ransac", "one-point-paper",
    ],
)  # fmt: skip
def test_it_tracks_every_frame(kitti_06: Path, name: str) -> None:
    _, _, estimates = replayed(kitti_06, name)
    assert len(estimates) == 51
    assert {e.status for e in estimates} == {Status.TRACKING}


def test_one_point_drifts_by_less_than_a_percent_in_space(kitti_06: Path) -> None:
    true_3d, _, estimates = replayed(kitti_06, "one-point-ransac")
    poses = np.array([e.pose_3d for e in estimates])
    drifted = drift(true_3d, poses)
    assert drifted is not None
    assert drifted.translation_percent <= 1.0
    assert drifted.rotation_deg_per_m <= 0.02


def test_one_point_drifts_by_less_than_a_percent_on_the_plane(kitti_06: Path) -> None:
    _, true_poses, estimates = replayed(kitti_06, "one-point-ransac")
    drifted = drift(lift(true_poses), lift(np.array([e.pose for e in estimates])))
    assert drifted is not None
    assert drifted.translation_percent <= 1.0
    assert drifted.rotation_deg_per_m <= 0.02


def test_the_paper_s_form_drifts_by_less_than_a_percent_on_the_plane(kitti_06: Path) -> None:
    _, true_poses, estimates = replayed(kitti_06, "one-point-paper")
    drifted = drift(lift(true_poses), lift(np.array([e.pose for e in estimates])))
    assert drifted is not None
    assert drifted.translation_percent <= 0.8
