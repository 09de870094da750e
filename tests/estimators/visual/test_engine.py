"""Which frame is the keyframe, whatever frames are: here they are poses, seen from so far."""

from dataclasses import dataclass

import numpy as np

from grouser.estimators.base import Observation, Status
from grouser.estimators.track_motion import arc_pose
from grouser.estimators.visual.base import Frontend
from grouser.estimators.visual.engine import KeyframeOdometry, Leg
from grouser.estimators.visual.fusion import RelativeFilter
from grouser.estimators.visual.keyframes import KeyframeRule
from grouser.estimators.visual.matching import Matches, Prediction
from grouser.estimators.visual.planar_motion import pose_motion
from grouser.estimators.visual.prediction import MotionPredictor, ScaleOptions, TrackPredictor
from grouser.estimators.visual.prior import ChassisPrior, MotionPrior
from grouser.estimators.visual.sight import Expectation, KeyframeSight, Sight
from grouser.estimators.visual.structure import OffsetEvidence
from grouser.geometry import Array, between, compose, wrap
from grouser.rig import TrackGeometry

TRACKS = TrackGeometry(gauge=0.4, width=0.08, effective_width=0.5)
STEP = arc_pose(0.02, 0.02)
TRUE_WIDTH = 0.6
"""m, so that tracks alone turn a fifth too far"""
SURE = np.diag([1e-4, 1e-4, 1e-4, 1e-3, 1e-3, 1e-3]) ** 2
RULE = KeyframeRule(points=60, distance=10.0, turn=10.0)


@dataclass(frozen=True)
class At:
    """A frame."""

    pose: Array

    @property
    def points(self) -> Array:
        return np.zeros((60, 3))


class Poses(Frontend[At, At]):
    """Observations tell the true pose."""

    @property
    def expected_noise(self) -> Array:
        return np.ones(6)

    def reset(self) -> None:
        pass

    def extract(self, observation: Observation) -> At:
        return At(observation["pose"])

    def make_keyframe(self, frame: At) -> At:
        return frame

    def match(self, keyframe: At, frame: At, prediction: Prediction) -> Matches:
        raise NotImplementedError

    def learn(self, matches: Matches, evidence: OffsetEvidence) -> None:
        raise NotImplementedError


class Sharp(KeyframeSight[At, At]):
    """Sees right, as long as the robot has turned no more than so far, rad."""

    def __init__(self, reach: float) -> None:
        self._reach = reach

    def look(
        self,
        keyframe: At,
        frame: At,
        expected: Expectation,
        prior: MotionPrior,
        rng: np.random.Generator,
    ) -> Sight:
        way = between(keyframe.pose, frame.pose)
        if abs(way[2]) > self._reach:
            told = {"inliers": 0.0, "matches": 0.0, "candidates": 0.0}
            return Sight(None, np.zeros((6, 6)), np.zeros(6), told)
        motion = np.concatenate([pose_motion(way), np.zeros(3)])
        told = {"inliers": 50.0, "matches": 55.0, "candidates": 200.0, "noise_ratio": 0.5}
        return Sight(motion, SURE, np.zeros(6), told)


class Misled(Sharp):
    """Where it looks at first, a few wrong points agree; all around, it sees right."""

    def look(
        self,
        keyframe: At,
        frame: At,
        expected: Expectation,
        prior: MotionPrior,
        rng: np.random.Generator,
    ) -> Sight:
        motion = np.concatenate([pose_motion(expected.pose), np.zeros(3)])
        told = {"inliers": 14.0, "matches": 20.0, "candidates": 40.0, "noise_ratio": 3.0}
        return Sight(motion, SURE, np.zeros(6), told)

    look_around = Sharp.look


def observation(frame: int, pose: Array) -> Observation:
    left, right = STEP[0] - 0.02 * TRUE_WIDTH / 2, STEP[0] + 0.02 * TRUE_WIDTH / 2
    return {"tracks": np.array([left, right]), "pose": pose, "stamp": np.array([0.1 * frame])}


def predictor(_: Observation) -> MotionPredictor:
    return TrackPredictor(TRACKS, ScaleOptions())


def drive(sight: Sharp, frames: int = 60) -> tuple[list[Status], Array, list[Leg]]:
    """The states of an odometry with these eyes, its error in the end, and its legs."""
    legs: list[Leg] = []
    odometry = KeyframeOdometry(
        Poses(),
        sight,
        make_predictor=predictor,
        make_filter=lambda errors: RelativeFilter(errors, disparity_sigma=0.0),
        prior=ChassisPrior(),
        mount_sigma=np.zeros(6),
        rule=RULE,
        lost_after=1.0,
        on_keyframe=legs.append,
    )
    truth, states = np.zeros(3), []
    odometry.reset(observation(0, truth), rng=np.random.default_rng(0))
    for frame in range(1, frames + 1):
        truth = compose(truth, STEP)
        estimate = odometry.update(observation(frame, truth))
        states.append(estimate.status)
    error = estimate.pose - truth
    return states, np.append(error[:2], wrap(error[2])), legs


def test_a_keyframe_that_is_out_of_view_gives_way_to_the_frame_before() -> None:
    states, error, legs = drive(Sharp(reach=0.11))
    assert set(states) == {Status.TRACKING}
    assert np.abs(error).max() < 1e-3
    stamps = [leg.stamp for leg in legs]
    np.testing.assert_allclose(stamps, 0.5 * np.arange(1, len(legs) + 1))
    assert all(leg.seen is not None for leg in legs)


def test_what_shows_nothing_of_the_frame_before_is_coasted_through() -> None:
    states, error, _ = drive(Sharp(reach=0.01), frames=6)
    assert set(states) == {Status.COASTING}
    assert abs(error[2]) > 1e-3


def test_where_few_points_agree_the_robot_is_sought_all_around() -> None:
    states, error, _ = drive(Misled(reach=1.0), frames=30)
    assert set(states) == {Status.TRACKING}
    assert np.abs(error).max() < 1e-3
