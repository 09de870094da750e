"""vo-imu-gps and the monocular filters with images that come late, seldom or not at all."""

from functools import cache

import numpy as np
import pytest

from grouser.estimators import PoseEstimate, Status, make
from grouser.estimators.base import Observation
from grouser.estimators.evaluation.consistency import nees
from grouser.geometry import Array, between, wrap
from grouser.rig import Rig
from grouser.scripts.abuse_work import drive

FRAMES = 60
EYES = ("left", "right")
FILTERS = ("vo-imu-gps", "one-point-ekf")


@cache
def yard() -> tuple[Rig, list[Observation], Array]:
    return drive(1, FRAMES)


def late(frames: int, *, every: int = 1, until: int = FRAMES) -> list[Observation]:
    """Images that are late by so many frames and come every so many; from a frame on none come."""
    _, observations, _ = yard()
    shown: list[Observation] = []
    for index, observation in enumerate(observations):
        source = max(min(index, until) - frames, 0) // every * every
        images = {eye: observations[source][eye] for eye in EYES}
        stamps = {f"{eye}_stamp": observations[source]["stamp"] for eye in EYES}
        shown.append({**observation, **images, **stamps})
    return shown


def run(name: str, observations: list[Observation]) -> list[PoseEstimate]:
    estimator = make(name, yard()[0])
    keys = estimator.requires | estimator.optional
    keys |= {f"{key}_stamp" for key in keys}
    seen = [{key: o[key] for key in keys & set(o)} for o in observations]
    first = estimator.reset(seen[0], rng=np.random.default_rng(0))
    return [first, *(estimator.update(o) for o in seen[1:])]


@cache
def in_time(name: str) -> list[PoseEstimate]:
    return run(name, yard()[1])


def rms(estimates: list[PoseEstimate]) -> float:
    off = np.array([e.pose[:2] for e in estimates]) - yard()[2][:, :2]
    return float(np.sqrt(np.mean(np.sum(off**2, axis=1))))


@pytest.mark.parametrize("name", FILTERS)
@pytest.mark.parametrize(("frames", "every"), [(2, 1), (3, 2)])
def test_late_images_cost_no_more_than_the_way_since(name: str, frames: int, every: int) -> None:
    """As stale poses they would be off by 7 cm and more."""
    estimates, truths = run(name, late(frames, every=every)), yard()[2]
    assert rms(estimates) < rms(in_time(name)) + 0.003
    assert [e.stamp for e in estimates] == [e.stamp for e in in_time(name)]
    for estimate, truth in list(zip(estimates, truths, strict=True))[1:]:
        error = np.append(estimate.pose[:2] - truth[:2], wrap(estimate.pose[2] - truth[2]))
        assert error @ np.linalg.pinv(estimate.covariance) @ error < 22.06  # as rare as 4 sigma
    poses = np.array([e.pose for e in estimates[5:]])
    assert nees(truths[5:], poses, np.array([e.covariance for e in estimates[5:]])).mean() < 5


@pytest.mark.parametrize("name", FILTERS)
def test_a_stamp_that_says_now_tells_nothing_new(name: str) -> None:
    for one, other in zip(run(name, late(0)), in_time(name), strict=True):
        np.testing.assert_allclose(one.pose, other.pose, atol=1e-12)
        np.testing.assert_allclose(one.covariance, other.covariance, atol=1e-15)


@pytest.mark.parametrize("name", FILTERS)
def test_the_way_since_the_images_is_in_the_covariance(name: str) -> None:
    """Later means less sure; and it is not kept: the next image makes it as sure as before."""
    sure, later = in_time(name), run(name, late(3))
    growth = [np.trace(b.covariance - a.covariance) for a, b in zip(sure, later, strict=True)]
    assert all(g > 0 for g in growth[10:])
    assert growth[-1] < 3 * np.median(growth[10:])


@pytest.mark.parametrize("name", FILTERS)
def test_a_camera_that_falls_silent_supports_the_pose_for_a_second(name: str) -> None:
    estimates = run(name, late(0, until=30))
    assert estimates[38].status is Status.TRACKING
    assert {e.status for e in estimates[43:]} == {Status.COASTING}
    assert np.trace(estimates[-1].covariance) > np.trace(estimates[38].covariance)
    error = between(yard()[2][-1], estimates[-1].pose)
    assert np.hypot(*error[:2]) < 0.15


@pytest.mark.parametrize("name", FILTERS)
def test_a_camera_that_comes_back_is_believed_again(name: str) -> None:
    gap = [*late(0, until=20)[:40], *late(0)[40:]]
    estimates = run(name, gap)
    assert {e.status for e in estimates[33:40]} == {Status.COASTING}
    assert {e.status for e in estimates[45:]} == {Status.TRACKING}
    error = between(yard()[2][-1], estimates[-1].pose)
    assert np.hypot(*error[:2]) < 0.2
