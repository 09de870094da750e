"""Does an estimator keep the contract? Public, so that other packages can check their own."""

import copy
import pickle
from typing import Any

import numpy as np

from grouser.estimators import registry
from grouser.estimators.base import (
    OBSERVATION_KEYS,
    TRUTH_KEYS,
    PoseEstimate,
    PoseEstimator,
    Status,
)
from grouser.estimators.conformance_subject import DARK, LIGHT, LIGHT_AGAIN, Subject
from grouser.estimators.estimate_checks import (
    arrays,
    check_memory,
    check_values,
    require,
    require_same,
)
from grouser.geometry import between

OUTWARD_KEYS = frozenset({"left", "right", "lidar", "gps", "lines", "points"})
"""Observations of the outside world, which the blackout takes away."""

# Drive and estimate may differ by this much of the way before the blackout: enough for any honest
# method, too little for one that stands still, turns the wrong way or mixes up frames.
_GROSS_ERROR, _GROSS_TURN = 0.2, 0.1  # 1, rad


def check_pose_estimator(name: str, **options: Any) -> None:
    """Check a registered estimator against the contract of `PoseEstimator`.

    It is shown a short synthetic drive with a blackout in the middle. What is checked: it declares
    known observation keys; the same generator and observations give the same bits, after `reset`
    and after pickling too; estimates have the shapes, types and stamps of the contract, a wrapped
    heading and a symmetric positive semi-definite covariance; they share no memory with the
    observation or with each other; observations are neither changed nor kept, and whoever writes
    into an estimate changes no later one; the pose follows the robot, and the status is TRACKING
    where the outside world is seen; a blackout ends in COASTING or LOST with a variance that grew,
    and light brings the estimator back, even if the blackout came first.

    Args:
        name: the registered name; see `grouser.estimators.names()`.
        options: keyword arguments of the estimator.

    Raises:
        AssertionError: a part of the contract is broken; the message says which.
        ValueError: nothing has that name, or it asks for the truth.
    """
    subject = Subject(name, options)
    _check_declaration(subject)
    estimates = _check_every_frame(subject)
    _check_follows_the_robot(subject, estimates)
    _check_tracks_in_the_light(subject, estimates)
    _check_blackout(subject, estimates)
    _check_recovery(subject, estimates)
    _check_determinism_and_reset(subject, estimates)
    _check_pickling(subject, estimates)
    _check_keeps_what_it_shares_with_nobody(subject, estimates)
    _check_start_in_the_dark(subject)


def _check_declaration(subject: Subject) -> None:
    kind = registry.estimator_class(subject.name)
    for attribute in ("requires", "optional"):
        keys = getattr(kind, attribute)
        require(
            isinstance(keys, frozenset),
            subject.name,
            f"`{attribute}` must be a frozenset of observation keys, got {keys!r}",
        )
        unknown = sorted(keys - OBSERVATION_KEYS - TRUTH_KEYS)
        allowed = sorted(OBSERVATION_KEYS)
        require(
            not unknown, subject.name, f"`{attribute}` has unknown keys {unknown}; known: {allowed}"
        )
    grouped = frozenset[str]().union(*kind.requires_one_of)
    require(
        grouped <= kind.optional,
        subject.name,
        f"`requires_one_of` has {sorted(grouped - kind.optional)}, which `optional` lacks",
    )
    require(
        "stamp" in kind.requires, subject.name, "`requires` must include 'stamp', to date estimates"
    )


def _check_every_frame(subject: Subject) -> list[PoseEstimate]:
    """Run the whole drive, checking each estimate by itself and beside what came before."""
    estimator = subject.make()
    estimates: list[PoseEstimate] = []
    for frame in range(len(subject.drive.observations)):
        observation = subject.shown(estimator, frame)
        before = {key: value.copy() for key, value in observation.items()}
        estimate = subject.advance(estimator, observation, frame)
        check_values(subject.name, frame, estimate, observation)
        check_memory(subject.name, frame, estimate, observation, estimates)
        for key, value in observation.items():
            unchanged = np.array_equal(value, before[key], equal_nan=value.dtype.kind == "f")
            require(unchanged, subject.name, f"frame {frame}: it changed the observation {key!r}")
        estimates.append(estimate)
    start = estimates[0].pose
    require(not start.any(), subject.name, f"reset must start at pose zero, got {start}")
    return estimates


def _check_follows_the_robot(subject: Subject, estimates: list[PoseEstimate]) -> None:
    truth, pose = subject.drive.poses[subject.last_light], estimates[subject.last_light].pose
    error = between(truth, pose)
    way = float(np.hypot(truth[0], truth[1]))
    close = np.hypot(error[0], error[1]) <= _GROSS_ERROR * way and abs(error[2]) <= _GROSS_TURN
    require(
        bool(close),
        subject.name,
        f"after {way:.2f} m the pose is {pose.tolist()} where the robot is at {truth.tolist()}; "
        "are frames (x forward, y left, heading counter-clockwise) mixed up?",
    )


def _check_tracks_in_the_light(subject: Subject, estimates: list[PoseEstimate]) -> None:
    if not registry.estimator_class(subject.name).requires & OUTWARD_KEYS:
        return
    status = estimates[subject.last_light].status
    require(
        status is Status.TRACKING,
        subject.name,
        f"it looks at the outside world, but after {LIGHT} frames in full light it is {status}",
    )


def _check_blackout(subject: Subject, estimates: list[PoseEstimate]) -> None:
    if subject.reads_truth:
        return
    status = estimates[subject.last_dark].status
    require(
        status in (Status.COASTING, Status.LOST),
        subject.name,
        f"{DARK * subject.drive.rig.dt:.1f} s of blackout ended in {status}; nothing was seen, so "
        "it must be COASTING or LOST",
    )
    before, after = (
        estimates[frame].covariance for frame in (subject.last_light, subject.last_dark)
    )
    # The robot kept driving forward, so that each of its position and heading became less certain.
    for what, part in (("position", slice(0, 2)), ("heading", slice(2, 3))):
        old, new = np.trace(before[part, part]), np.trace(after[part, part])
        require(
            new > old,
            subject.name,
            f"the variance of {what} went from {old:.3g} to {new:.3g} in the blackout, not up",
        )


def _check_recovery(subject: Subject, estimates: list[PoseEstimate]) -> None:
    before, after = estimates[subject.last_light].status, estimates[-1].status
    require(
        after == before,
        subject.name,
        f"{LIGHT_AGAIN} frames after the blackout it is {after}, before it was {before}",
    )


def _check_determinism_and_reset(subject: Subject, estimates: list[PoseEstimate]) -> None:
    estimator = subject.make()
    require_same(
        subject.name, estimates, subject.run(estimator), "another instance, same generator"
    )
    require_same(subject.name, estimates, subject.run(estimator), "the same instance, after reset")


def _check_pickling(subject: Subject, estimates: list[PoseEstimate]) -> None:
    estimator = subject.make()
    for frame in range(LIGHT // 2):
        subject.advance(estimator, subject.shown(estimator, frame), frame)
    try:
        twin: PoseEstimator = pickle.loads(pickle.dumps(estimator))
    except Exception as error:
        raise AssertionError(f"{subject.name}: it cannot be pickled: {error!r}") from error
    rest = range(LIGHT // 2, len(estimates))
    resumed = [subject.advance(twin, subject.shown(twin, frame), frame) for frame in rest]
    require_same(
        subject.name, estimates[LIGHT // 2 :], resumed, "a pickled copy, from the middle on"
    )


def _check_keeps_what_it_shares_with_nobody(
    subject: Subject, estimates: list[PoseEstimate]
) -> None:
    """Neither an observation nor an estimate that was given out is what it works with."""
    estimator = subject.make()
    frames = range(len(estimates))
    scribbled = []
    for frame in frames:
        observation = subject.shown(estimator, frame)
        estimate = subject.advance(estimator, observation, frame)
        scribbled.append(copy.deepcopy(estimate))
        for value in observation.values():
            value[...] = 85  # as an environment that reuses its buffers would
        for _, array in arrays(estimate):
            if array.flags.writeable:
                array[...] = 85  # as a caller that moves the pose to another frame in place would
    require_same(
        subject.name,
        estimates,
        scribbled,
        "a run whose observations and estimates are overwritten after each call",
    )


def _check_start_in_the_dark(subject: Subject) -> None:
    estimator = subject.make()
    frames = range(subject.last_dark - 2, len(subject.drive.observations))
    for frame in frames:
        observation = subject.shown(estimator, frame)
        estimate = subject.advance(estimator, observation, frame, first=frames.start)
        check_values(subject.name, frame, estimate, observation)
    lit = subject.reads_truth or estimate.status is not Status.LOST
    require(
        lit, subject.name, f"started in the dark, it is still LOST {LIGHT_AGAIN} frames after it"
    )
