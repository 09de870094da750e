"""What gyroscope and receiver may do to the prediction, and what not."""

import numpy as np
import pytest

from grouser.estimators.gyro import Gyro, GyroOptions
from grouser.estimators.joint_filter import POSITION_GATE, JointFilter
from grouser.estimators.position_fixes import PositionFixes
from grouser.estimators.visual.constant_errors import NO_ERRORS
from grouser.estimators.visual.fusion import RelativePose
from grouser.estimators.visual.prediction import Increment
from grouser.geometry import Array
from grouser.rig import Gps, Imu

FORWARD = Increment(np.array([0.05, 0.0, 0.0]), np.diag([1e-3, 1e-4, 2e-3]) ** 2, np.zeros((3, 0)))


def shown(step: int, fix: Array | None = None, rate: float = 0.0) -> dict[str, Array]:
    return {
        "stamp": np.array([0.1 * step]),
        "imu": np.array([0.0, 0.0, 9.81, 0.0, 0.0, rate]),
        "gps": np.full(2, np.nan) if fix is None else fix,
    }


def started(bias_sigma: float = 0.0) -> JointFilter:
    gyro = Gyro(Imu(0.05, 0.002), 0.1, GyroOptions(bias_sigma=bias_sigma, bias_walk=0.0))
    joint = JointFilter(NO_ERRORS, gyro=gyro, fixes=PositionFixes(Gps(0.3)))
    joint.reset(shown(0))
    return joint


def test_the_gyroscope_bounds_the_turn_and_what_it_disagrees_with_slipped() -> None:
    joint = started()
    joint.predict(FORWARD)
    assert not joint.hear(shown(1), blind=True).slipped
    assert joint.state.pose_covariance[2, 2] < (2.01e-4) ** 2
    joint.predict(FORWARD)
    heard = joint.hear(shown(2, rate=0.5), blind=True)
    assert heard.slipped
    assert abs(joint.state.pose[2] - 0.05) < 1e-3


@pytest.mark.parametrize("alone", [True, False])
def test_a_turn_that_the_gyroscope_did_not_feel_is_believed_the_third_time(alone: bool) -> None:
    """Against the gyroscope alone, not against tracks that agree with it."""
    joint = started()
    turned = RelativePose(np.array([0.05, 0.0, 0.3]), np.diag([1e-3] * 3) ** 2, np.zeros(3))
    ahead = RelativePose(np.array([0.05, 0.0, 0.0]), turned.covariance, np.zeros(3))
    believed = []
    for step, seen in enumerate([turned, turned, ahead, turned, turned, turned], start=1):
        joint.predict(FORWARD)
        joint.hear(shown(step), blind=True)
        believed.append(not joint.disbelieves(seen, alone=alone))
        joint.commit(joint.coast())
    assert believed == [False, False, True, False, False, alone]


def test_without_a_turn_that_was_felt_nothing_is_disbelieved() -> None:
    """The tracks alone may slip: vision wins."""
    turned = RelativePose(np.array([0.05, 0.0, 0.3]), np.diag([1e-3] * 3) ** 2, np.zeros(3))
    joint = JointFilter(NO_ERRORS, gyro=None, fixes=None)
    joint.reset(shown(0))
    joint.predict(FORWARD)
    joint.hear(shown(1), blind=True)
    assert not joint.disbelieves(turned, alone=True) and joint.fuse(turned).slipped


def test_what_was_seen_since_the_keyframe_is_known_when_nothing_more_is_seen() -> None:
    """A prediction that knows nothing, a sight that is sure, and frames without one: as if the
    keyframe had been the frame of the sight."""
    guess = Increment(np.array([0.2, 0.0, 0.1]), np.diag([0.5, 0.5, 0.5]) ** 2, np.zeros((3, 0)))
    seen = RelativePose(np.array([0.05, 0.01, 0.02]), np.diag([1e-3] * 3) ** 2, np.zeros(3))
    going_on, anew = started(), started()
    for joint in (going_on, anew):
        joint.predict(guess)
        joint.hear(shown(1, rate=0.2), blind=True)
        fused = joint.fuse(seen)
        if joint is anew:
            joint.commit(fused)
        for step in range(2, 5):
            joint.predict(FORWARD)
            joint.hear(shown(step), blind=True)
    one, other = going_on.coast().state, anew.coast().state
    np.testing.assert_allclose(one.pose, other.pose, atol=1e-9)
    np.testing.assert_allclose(one.pose_covariance, other.pose_covariance, atol=1e-12)
    assert np.hypot(*(one.pose[:2] - [0.2, 0.013])) < 1e-3
    assert np.sqrt(one.pose_covariance.trace()) < 5e-3
    going_on.commit(going_on.coast())
    np.testing.assert_array_equal(going_on.state.relative, np.zeros(3))


def test_a_fix_beyond_the_gate_changes_nothing_while_vision_tracks() -> None:
    joint = started()
    for step in range(1, 9):
        joint.predict(FORWARD)
        before = joint.state
        heard = joint.hear(shown(step, np.array([5.0, 5.0])), blind=False)
        assert heard.fix_nis > POSITION_GATE and not heard.fixed
        assert np.array_equal(joint.state.pose[:2], before.pose[:2])


def test_blind_the_third_of_them_is_believed() -> None:
    joint, wall = started(), np.array([-2.0, 1.0])
    fixed = []
    for step in range(1, 12):
        joint.predict(FORWARD)
        fixed.append(joint.hear(shown(step, wall), blind=True).fixed)
    assert fixed[:3] == [False, False, True] and all(fixed[3:])
    assert np.linalg.norm(joint.state.pose[:2] - wall) < 0.3


def test_one_that_is_far_off_between_good_ones_is_never_believed() -> None:
    joint, at = started(), np.zeros(2)
    for step in range(1, 30):
        joint.predict(FORWARD)
        at = at + [0.05, 0.0]
        spoilt = step % 3 == 0
        heard = joint.hear(shown(step, at + 9.0 if spoilt else at), blind=True)
        assert heard.fixed is not spoilt
    assert np.linalg.norm(joint.state.pose[:2] - at) < 0.1
