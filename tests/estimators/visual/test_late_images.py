"""Late images: the odometry sees what it would have seen in time; the rest of the way is led on."""

from collections.abc import Iterable

import numpy as np
import pytest

from grouser.estimators import PoseEstimate, Status
from grouser.estimators.base import Observation
from grouser.estimators.synthetic_drive import RIG, Drive, synthetic_drive
from grouser.estimators.visual.late_images import LateImages
from grouser.estimators.visual.odometry import VisualOdometry
from grouser.estimators.visual.prediction import (
    MotionPredictor,
    ScaleOptions,
    TrackPredictor,
    VelocityPredictor,
)
from grouser.geometry import Array

FRAMES = 24
EYES = ("left", "right")


class Spy:
    """An odometry that notes what it is shown."""

    def __init__(self) -> None:
        self.shown: list[Observation] = []

    def reset(self, observation: Observation, *, rng: np.random.Generator) -> PoseEstimate:
        return self.update(observation)

    def update(self, observation: Observation) -> PoseEstimate:
        self.shown.append(observation)
        return PoseEstimate(
            pose=np.zeros(3),
            covariance=np.zeros((3, 3)),
            status=Status.TRACKING,
            stamp=float(observation["stamp"][0]),
        )

    def of_predictor(self) -> tuple[Array, Array]:
        n = 4 if "tracks" in self.shown[0] else 0
        return np.zeros(n), np.zeros((n, n))


def predictor(observation: Observation) -> MotionPredictor:
    assert RIG.tracks is not None
    if "tracks" in observation:
        return TrackPredictor(RIG.tracks, ScaleOptions(turn_noise=0.02))
    return VelocityPredictor(np.ones(3) * RIG.dt)


def delayed(drive: Drive, frames: dict[str, int], *, every: int = 1) -> list[Observation]:
    """Each eye late by so many frames, and only every so many frames a new image."""
    late: list[Observation] = []
    for index, observation in enumerate(drive.observations):
        shown = dict(observation)
        for eye in EYES:
            source = max(index - frames.get(eye, 0), 0) // every * every
            shown[eye] = drive.observations[source][eye]
            shown[f"{eye}_stamp"] = drive.observations[source]["stamp"]
        late.append(shown)
    return late


def spied(observations: Iterable[Observation], lost_after: float = 1.0) -> tuple[Spy, list[Status]]:
    spy, shown = Spy(), list(observations)
    late = LateImages(spy, predictor, dt=RIG.dt, lost_after=lost_after)
    late.reset(shown[0], rng=np.random.default_rng(0))
    return spy, [late.update(observation).status for observation in shown[1:]]


@pytest.fixture(scope="module")
def drive() -> Drive:
    return synthetic_drive(frames=FRAMES, blackout=range(0))


@pytest.mark.parametrize("frames", [{}, {"left": 2, "right": 2}, {"left": 3}, {"right": 1}])
def test_the_odometry_sees_what_it_would_have_seen_in_time(
    drive: Drive, frames: dict[str, int]
) -> None:
    """Pair by pair and to the bit, with the tracks up to the pair, however late the images are."""
    spy, _ = spied(delayed(drive, frames))
    assert len(spy.shown) == FRAMES - max(frames.values(), default=0)
    for seen, timely in zip(spy.shown, drive.observations, strict=False):
        for key in (*EYES, "tracks", "stamp"):
            np.testing.assert_array_equal(seen[key], timely[key])


def test_seldom_pairs_are_shown_once_with_all_the_motion_between_them(drive: Drive) -> None:
    spy, _ = spied(delayed(drive, {"left": 2, "right": 2}, every=4))
    assert [float(o["stamp"][0]) for o in spy.shown] == pytest.approx(
        [0.0, 0.4, 0.8, 1.2, 1.6, 2.0]
    )
    for index, seen in enumerate(spy.shown[1:]):
        steps = drive.observations[4 * index + 1 : 4 * index + 5]
        np.testing.assert_allclose(seen["tracks"], sum(o["tracks"] for o in steps), rtol=1e-12)


def test_tracks_that_are_late_are_waited_for(drive: Drive) -> None:
    """A pair is shown when the motion up to it is known; the way to now goes on as it went."""
    late = []
    for index, observation in enumerate(drive.observations):
        source = drive.observations[max(index - 2, 0)]
        stamps = {f"{eye}_stamp": observation["stamp"] for eye in EYES}
        late.append(
            {**observation, "tracks": source["tracks"], "tracks_stamp": source["stamp"], **stamps}
        )
    spy, _ = spied(late)
    assert len(spy.shown) == FRAMES - 2
    for seen, timely in zip(spy.shown, drive.observations, strict=False):
        np.testing.assert_array_equal(seen["tracks"], timely["tracks"])


def test_a_pair_that_is_too_old_supports_nothing(drive: Drive) -> None:
    shown = delayed(drive, {})
    stopped = [{**shown[min(k, 7)], "stamp": np.array([k * RIG.dt])} for k in range(18)]
    _, statuses = spied(stopped, lost_after=0.5)
    assert statuses[:12] == [Status.TRACKING] * 12
    assert set(statuses[12:]) == {Status.COASTING}
    blind = [{k: v for k, v in o.items() if k != "tracks"} for o in stopped]
    assert spied(blind, lost_after=0.5)[1][12:] == [Status.LOST] * 5


def test_without_stamps_all_is_of_now(drive: Drive) -> None:
    """And a stamp that says "now" tells nothing new."""
    plain, stamped = (VisualOdometry(RIG), VisualOdometry(RIG))
    for odometry, observations in ((plain, drive.observations), (stamped, delayed(drive, {}))):
        odometry.reset(observations[0], rng=np.random.default_rng(0))
    for one, other in zip(drive.observations[1:8], delayed(drive, {})[1:8], strict=True):
        a, b = plain.update(one), stamped.update(other)
        np.testing.assert_allclose(a.pose, b.pose, atol=1e-12)
        np.testing.assert_allclose(a.covariance, b.covariance, atol=1e-15)


@pytest.mark.parametrize(("frames", "every"), [(2, 1), (0, 2), (3, 5)])
@pytest.mark.parametrize("tracks", [True, False])
def test_the_pose_is_that_of_now(drive: Drive, frames: int, every: int, tracks: bool) -> None:
    """Within 4 sigma and 2 % of the way; as a stale pose it would be off by 5 to 30 cm."""
    late = delayed(drive, dict.fromkeys(EYES, frames), every=every)
    shown = [{k: v for k, v in o.items() if tracks or k != "tracks"} for o in late]
    odometry = VisualOdometry(RIG)
    odometry.reset(shown[0], rng=np.random.default_rng(0))
    for index, observation in enumerate(shown[1:], start=1):
        estimate = odometry.update(observation)
        if index < 12:
            continue
        error = estimate.pose - drive.poses[index]
        assert np.hypot(*error[:2]) < 0.02 * (0.05 * FRAMES)
        assert error @ np.linalg.solve(estimate.covariance + 1e-12 * np.eye(3), error) < 16
        assert estimate.stamp == pytest.approx(index * RIG.dt)
