"""`vo-line-slam`: what it predicts by, and what it refuses. It drives in the conformance suite."""

import numpy as np
import pytest

from grouser.estimators import make
from grouser.estimators.base import readable
from grouser.estimators.line_slam.map import LineMapper
from grouser.estimators.synthetic_drive import RIG, synthetic_drive


def test_it_maps_the_room_that_vision_drives_through() -> None:
    drive = synthetic_drive(frames=12, blackout=range(0))
    estimator = make("vo-line-slam", drive.rig)
    assert isinstance(estimator, LineMapper)
    shown = [
        readable(estimator, observation, truth)
        for observation, truth in zip(drive.observations, drive.truths, strict=True)
    ]
    estimator.reset(shown[0], rng=np.random.default_rng(0))
    for observation in shown[1:]:
        estimate = estimator.update(observation)
    assert len(estimator.map) == 4
    assert estimate.pose == pytest.approx(drive.poses[-1], abs=0.03)


def test_what_it_cannot_do_is_refused() -> None:
    with pytest.raises(ValueError, match=r"needs rig.line_sensor or rig.lidar to see lines"):
        make("vo-line-slam", RIG.with_overrides({"line_sensor": None, "lidar": None}))
    with pytest.raises(ValueError, match="not shown"):
        make("vo-line-slam", RIG, odometry="ground-truth")
    estimator = make("vo-line-slam", RIG)
    with pytest.raises(RuntimeError, match="call reset"):
        estimator.update({})
