"""What vision sees from frame to frame: rest against moving tracks, jumps that no mass makes."""

import numpy as np
import pytest

from grouser.estimators.visual.fusion import RelativePose
from grouser.estimators.visual.glimpses import Glimpses
from grouser.estimators.visual.prediction import Increment
from grouser.geometry import Array, compose, exp, log

STEP = np.array([0.04, 0.0, 0.05])  # m, m, rad over a frame of 0.1 s
SURE = 1e-3


def seen(steps: list[Array], sigma: float = SURE, durations: list[float] | None = None) -> Glimpses:
    """Glimpses of a way of steps, each in the frame of the one before; all but the last are
    believed."""
    glimpses, pose = Glimpses(), np.zeros(3)
    for k, (step, duration) in enumerate(zip(steps, durations or [0.1] * len(steps), strict=True)):
        if k:
            glimpses.believe(glimpses.last)
        pose = compose(pose, step)
        glimpses.take(glimpse(pose, sigma), duration)
    return glimpses


def glimpse(pose: Array, sigma: float = SURE) -> RelativePose:
    return RelativePose(pose, np.eye(3) * sigma**2, np.zeros(3))


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


def test_what_goes_on_as_it_jumped_is_a_motion_once_a_mass_may_have_it() -> None:
    other = np.array([0.0, 0.1, 0.0])
    glimpses = seen([STEP, other])
    pose, jumps = compose(STEP, other), []
    for _ in range(4):
        jumps.append(glimpses.jump())
        pose = compose(pose, other)
        glimpses.take(glimpse(pose), 0.1)
    assert jumps == [True, True, False, False]


def test_what_was_mistaken_is_no_measure_of_what_follows() -> None:
    glimpses = seen([STEP, STEP])
    glimpses.believe(glimpses.last)
    glimpses.take(glimpse(np.array([1.3, -1.2, 0.1])), 0.1)
    assert glimpses.jump()
    glimpses.take(glimpse(way_of(4)), 0.1)
    assert not glimpses.jump()


def way_of(steps: int) -> Array:
    """(3,) after so many of them."""
    return exp(steps * log(STEP))


def test_what_nothing_measures_goes_on_as_it_went_for_half_a_second() -> None:
    glimpses = seen([STEP, STEP])
    glimpses.believe(glimpses.last)
    for k in range(8):
        glimpses.take(None, 0.1)
        assert glimpses.going_on() == pytest.approx(way_of(2 + min(k + 1, 5)))
    glimpses.start()  # a keyframe that was not seen either
    glimpses.take(None, 0.1)
    assert glimpses.going_on() == pytest.approx([0, 0, 0])


def test_what_was_seen_to_stand_stands() -> None:
    glimpses = seen([STEP, np.zeros(3)])
    glimpses.believe(glimpses.last)
    glimpses.take(None, 0.1)
    assert glimpses.going_on() == pytest.approx(STEP)


def test_a_mass_holds_what_is_seen_from_afar_and_hardly_what_is_seen_well() -> None:
    glimpses = seen([STEP, STEP])
    glimpses.believe(glimpses.last)
    leap = compose(way_of(3), [0.0, 0.5, 0.0])
    glimpses.take(glimpse(leap, sigma=1.0), 0.1)
    far = glimpses.steadied(glimpse(leap, sigma=1.0))
    assert far.pose == pytest.approx(way_of(3), abs=0.01)
    assert np.sqrt(np.diag(far.covariance)).max() < 0.05
    near = glimpses.steadied(glimpse(leap, sigma=1e-4))
    assert near.pose == pytest.approx(leap, abs=1e-3)
    assert near.covariance == pytest.approx(1e-8 * np.eye(3), abs=1e-10)


def test_before_anything_was_seen_a_robot_is_slow() -> None:
    assert not seen([STEP]).jump()
    assert seen([np.array([1.6, 0.0, 0.0])]).jump()


def test_a_longer_frame_takes_a_longer_way() -> None:
    ways = [STEP, compose(compose(STEP, STEP), STEP)]
    assert not seen(ways, durations=[0.1, 0.3]).jump()
    assert seen([STEP, 3 * np.array([0.04, 0.03, 0.0])], durations=[0.1, 0.1]).jump()


def test_stamps_that_stand_tell_no_motion() -> None:
    assert not seen([STEP, STEP + [1.0, 0.0, 0.0]], durations=[0.0, 0.0]).jump()


def test_after_a_blind_frame_more_is_possible_but_not_everything() -> None:
    for change, jumps in (([0.0, 0.1, 0.0], False), ([1.0, 1.0, 0.0], True)):
        glimpses = seen([STEP, STEP])
        glimpses.believe(glimpses.last)
        glimpses.take(None, 0.1)
        glimpses.take(glimpse(compose(way_of(4), change)), 0.1)
        assert glimpses.jump() is jumps


def test_a_keyframe_does_not_interrupt_the_motion() -> None:
    glimpses = seen([STEP, STEP])
    glimpses.believe(glimpses.last)
    glimpses.start()
    glimpses.take(glimpse(STEP), 0.1)
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
