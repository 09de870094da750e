"""Two scans correct an odometry that turns wrongly, and say how well."""

import numpy as np
import pytest

from grouser.estimators.line_slam.motion_source import motion_source
from grouser.estimators.line_slam.odometry_predictor import OdometryPredictor
from grouser.estimators.line_slam.scan_aided_predictor import ScanAidedPredictor
from grouser.estimators.synthetic_drive import RIG, synthetic_drive
from grouser.estimators.visual.prediction import Increment
from grouser.geometry import between, wrap
from grouser.rig_motion import Odometry

TURNED = np.radians(4.0)
NONE = np.zeros(2)


def predicted(*, dark: range = range(0)) -> tuple[list[Increment], list[np.ndarray]]:
    """Increments of an odometry that turns too far at every step, and the true ones."""
    drive = synthetic_drive(frames=10, blackout=dark)
    assert RIG.lidar is not None
    odometry = OdometryPredictor(Odometry())
    predictor = ScanAidedPredictor(odometry, RIG, drive.observations[0])
    increments = []
    for observation in drive.observations[1:]:
        wrong = observation["odometry"] + np.array([0.0, 0.0, TURNED])
        increments.append(predictor.predict({**observation, "odometry": wrong}, NONE))
    true = [between(a, b) for a, b in zip(drive.poses[:-1], drive.poses[1:], strict=True)]
    return increments, true


def test_it_turns_as_the_scans_say_and_is_not_too_sure() -> None:
    for increment, true in zip(*predicted(), strict=True):
        error = increment.pose - true
        error[2] = wrap(error[2])
        assert abs(error[2]) < np.radians(1.5) < TURNED / 2
        assert error @ np.linalg.solve(increment.covariance, error) < 16


def test_without_returns_the_odometry_is_as_it_was() -> None:
    increments, true = predicted(dark=range(4, 6))
    for k in (3, 4, 5):  # to the dark, in it, and out of it
        assert wrap(increments[k].pose[2] - true[k][2]) == pytest.approx(TURNED)
    assert abs(wrap(increments[7].pose[2] - true[7][2])) < TURNED / 2


def test_scans_that_are_not_new_tell_nothing() -> None:
    drive = synthetic_drive(frames=3, blackout=range(0))
    assert RIG.lidar is not None
    first = {**drive.observations[0], "lidar_stamp": np.zeros(1)}
    predictor = ScanAidedPredictor(OdometryPredictor(Odometry()), RIG, first)
    again = {**drive.observations[1], "lidar_stamp": np.zeros(1)}
    plain = OdometryPredictor(Odometry()).predict(again, NONE)
    assert predictor.predict(again, NONE).covariance == pytest.approx(plain.covariance)


@pytest.mark.parametrize("scan_aided", [True, False])
def test_scans_aid_odometry_only_where_that_is_asked_for(scan_aided: bool) -> None:
    """Whoever matches scans by himself would count each twice."""
    drive = synthetic_drive(frames=2, blackout=range(0))
    make_motion = motion_source(RIG, "odometry", readable=frozenset(), scan_aided=scan_aided)
    first, then = drive.observations
    step = make_motion(first, np.random.default_rng(0)).predict(then, np.zeros(3), NONE)
    plain = OdometryPredictor(Odometry()).predict(then, NONE)
    narrower = np.linalg.det(step.covariance) < 0.9 * np.linalg.det(plain.covariance)
    assert narrower == scan_aided
