"""An estimator as a sensor of relative motion."""

import numpy as np
import pytest

from grouser.estimators import Status
from grouser.estimators.base import PoseEstimate
from grouser.estimators.pose_source import PoseSource, relative_covariance
from grouser.estimators.synthetic_drive import RIG, synthetic_drive
from grouser.geometry import between, compose_jacobians


def estimate(pose: list[float], covariance: np.ndarray) -> PoseEstimate:
    return PoseEstimate(np.array(pose), covariance, Status.TRACKING, 0.0)


def test_the_covariance_that_a_motion_added_is_found_again() -> None:
    rng = np.random.default_rng(0)
    A, B = rng.normal(size=(2, 3, 3))
    before, R = estimate([1.0, 2.0, 0.7], 1e-4 * A @ A.T), 1e-5 * B @ B.T
    motion = np.array([0.2, 0.01, 0.1])
    F, G = compose_jacobians(before.pose, motion)
    after = estimate([0.0, 0.0, 0.0], F @ before.covariance @ F.T + G @ R @ G.T)
    found = relative_covariance(before, after, motion)
    assert np.abs(found - R).max() < 2e-8  # the floor


def test_where_the_covariance_shrank_the_motion_has_the_floor_and_stays_definite() -> None:
    before = estimate([0.0, 0.0, 0.0], np.eye(3))
    found = relative_covariance(before, estimate([0.0, 0.0, 0.0], 0.5 * np.eye(3)), np.zeros(3))
    assert (np.linalg.eigvalsh(found) > 0).all() and found.max() < 1e-6


def test_it_sees_the_motion_since_the_anchor_and_none_across_a_gap() -> None:
    drive = synthetic_drive(frames=14, blackout=range(6, 9))
    source = PoseSource("one-point-ransac", RIG, {})
    source.reset(drive.observations[0], rng=np.random.default_rng(0))
    known = []
    for k in range(1, 14):
        known.append(source.update(drive.observations[k]))
        if known[-1]:
            pose, R = source.relative()
            start = max((j for j in range(k) if j == 0 or not known[j - 1]), default=0)
            truth = between(drive.poses[start], drive.poses[k])
            assert np.abs(pose - truth).max() < 0.01
            assert (np.linalg.eigvalsh(R) > 0).all()
    assert known[:5] == [True] * 5 and known[5:9] == [False] * 4 and known[-1]


@pytest.mark.parametrize(
    ("name", "read"), [("dead-reckoning", "tracks"), ("ground-truth", "true_pose")]
)
def test_a_source_of_the_tracks_or_the_truth_is_refused(name: str, read: str) -> None:
    with pytest.raises(ValueError, match=rf"'{name}' cannot be the source, .*'{read}"):
        PoseSource(name, RIG, {})
