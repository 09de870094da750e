"""What vision sees from frame to frame: rest against moving tracks, jumps that no mass makes."""

import numpy as np
import pytest

from grouser.estimators.visual.fusion import RelativePose
from grouser.estimators.visual.glimpses import Glimpses
from grouser.estimators.visual.prediction import Increment
from grouser.geometry import Array, compose

STEP = np.array([0.04, 0.0, 0.05])  # m, m, rad over a frame of 0.1 s
SURE = 1e-3


def seen(steps: list[Array], sigma: float = SURE, durations: list[float] | None = None) -> Glimpses:
    """Glimpses of a way of steps, each in the frame of the one before."""
    glimpses, pose = Glimpses(), np.zeros(3)
    for step, duration in zip(steps, durations or [0.1] * len(steps), strict=True):
        pose = compose(pose, step)
        glimpses.take(RelativePose(pose, np.eye(3) * sigma**2, np.zeros(3)), duration)
    return glimpses


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        ([0.0, 0.0, 0.0], False),
        ([-0.02, 0.0, 0.0], False),  # brakes at 2 m/s^2
        ([-0.04, 0.0, -0.05], False),  # and stands within a frame
        ([0.0, 0.1, 0.0], True),  # 1 m/s to the side, out of nothing
        ([0.0, 0.0, 0.3], True),
        ([1.7, 1.0, 0.0], True),
    ],
)
def test_a_mass_keeps_its_motion(change: list[float], expected: bool) -> None:
    assert seen([STEP, STEP, STEP + change]).jump() is expected


def test_a_jump_is_none_where_vision_sees_no_better() -> None:
    assert not seen([STEP, STEP + [0.0, 0.1, 0.0]], sigma=0.05).jump()


def test_what_goes_on_as_it_jumped_is_a_motion_after_all() -> None:
    other = np.array([0.0, 0.1, 0.0])
    assert seen([STEP, other]).jump() and not seen([STEP, other, other]).jump()


def test_a_longer_frame_takes_a_longer_way() -> None:
    ways = [STEP, compose(compose(STEP, STEP), STEP)]
    assert not seen(ways, durations=[0.1, 0.3]).jump()
    assert seen([STEP, 3 * np.array([0.04, 0.03, 0.0])], durations=[0.1, 0.1]).jump()


def test_stamps_that_stand_tell_no_motion() -> None:
    assert not seen([STEP, STEP + [1.0, 0.0, 0.0]], durations=[0.0, 0.0]).jump()


def test_after_a_blind_frame_nothing_is_known_of_the_motion() -> None:
    glimpses = seen([STEP, STEP])
    glimpses.take(None, 0.1)
    glimpses.take(RelativePose(np.array([1.0, 1.0, 0.0]), np.eye(3) * 1e-6, np.zeros(3)), 0.1)
    assert not glimpses.jump()


def test_a_keyframe_does_not_interrupt_the_motion() -> None:
    glimpses = seen([STEP, STEP])
    glimpses.start()
    glimpses.take(RelativePose(STEP, np.eye(3) * SURE**2, np.zeros(3)), 0.1)
    assert not glimpses.jump()
    assert glimpses.last.pose == pytest.approx(STEP)


def test_nowhere_is_farther_than_the_robot_may_have_come() -> None:
    """By its tracks or as it moved before, and by what it may have gained since."""
    glimpses, still = seen([STEP]), np.zeros(3)
    near, far = compose(STEP, [0.09, 0.0, 0.0]), compose(STEP, [0.0, 1.4, 0.0])
    assert not glimpses.leaps(near, 0.1, STEP, still)
    assert glimpses.leaps(far, 0.1, STEP, still)
    assert not glimpses.leaps(far, 0.1, still, np.array([0.0, -1.4, 0.0]))
    assert not glimpses.leaps(far, 1.0, STEP, still), "in a second it may"


def test_rest_against_tracks_that_move() -> None:
    tracks = Increment(STEP, np.eye(3) * 1e-6, np.zeros((3, 0)))
    assert seen([STEP, np.zeros(3)]).stand(tracks)
    assert not seen([STEP, STEP]).stand(tracks)
    assert not Glimpses().stand(tracks)
