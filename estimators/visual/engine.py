"""Paper 1's Fig. 3 on keyframes (SPEC 1.5), wherever the frames come from."""

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Generic

import numpy as np

from grouser.estimators.base import Observation, PoseEstimate, Status
from grouser.estimators.visual.base import FrameT, Frontend, KeyframeT
from grouser.estimators.visual.belief import Belief, Verdict
from grouser.estimators.visual.constant_errors import ConstantErrors
from grouser.estimators.visual.disparity_check import DisparityCheck
from grouser.estimators.visual.fusion import RelativePose
from grouser.estimators.visual.keyframes import KeyframeRule
from grouser.estimators.visual.planar_motion import pose_motion, pose_to_motion
from grouser.estimators.visual.pose_filter import PoseFilter
from grouser.estimators.visual.prediction import Increment, MotionPredictor
from grouser.estimators.visual.prior import VAGUE_SIDE, ChassisPrior, MotionPrior
from grouser.estimators.visual.sight import Expectation, KeyframeSight, Sight
from grouser.estimators.visual.structure import OffsetEvidence
from grouser.geometry import Array

PredictorFactory = Callable[[Observation], MotionPredictor]
"""Makes the predictor that the first observation has the means for."""
FilterFactory = Callable[[ConstantErrors], PoseFilter]
"""Makes the filter for a predictor with these constant errors."""


@dataclass(frozen=True, slots=True)
class Leg:
    """What vision said of the way from one keyframe to the next."""

    stamp: float
    """At its end, s"""
    seen: RelativePose | None
    """None where vision failed."""
    evidence: OffsetEvidence | None
    """Of the disparity offset; None where the points tell nothing."""


@dataclass(frozen=True, slots=True)
class _Seen(Generic[FrameT]):
    """A frame and what was made of it: all that makes it the keyframe."""

    frame: FrameT
    sight: Sight
    verdict: Verdict
    stamp: float


@dataclass(slots=True)
class _Clock:
    """When the stages of a frame ended, s."""

    started: float
    extracted: float = 0.0
    looked: float = 0.0


OnKeyframe = Callable[[Leg], None]


def _nobody(leg: Leg) -> None:
    """Nobody wants to know."""


OnSlope = Callable[[Increment, Array], Increment]
"""What a slope makes of a measured increment, given up (3,) as the robot was last seen to lean."""


def as_on_level(increment: Increment, vertical: Array) -> Increment:
    """It makes nothing of it."""
    return increment


class KeyframeOdometry(Generic[FrameT, KeyframeT]):
    """The pose since the first observation, from what is seen of the last keyframe.

    A frame that vision fails on is bridged by prediction (COASTING); without a prediction that
    measures, for longer than `lost_after`, LOST.
    """

    def __init__(
        self,
        frontend: Frontend[FrameT, KeyframeT],
        sight: KeyframeSight[FrameT, KeyframeT],
        *,
        make_predictor: PredictorFactory,
        make_filter: FilterFactory,
        prior: ChassisPrior,
        mount_sigma: Array,
        rule: KeyframeRule,
        lost_after: float,
        on_keyframe: OnKeyframe = _nobody,
        on_slope: OnSlope = as_on_level,
    ) -> None:
        """
        Args:
            mount_sigma: (6,) how well the camera's place on the robot is known.
            lost_after: s.
            on_keyframe: called with every leg, for whoever calibrates.
            on_slope: what a slope makes of what the predictor measured.
        """
        self._on_slope = on_slope
        self._on_keyframe = on_keyframe
        self._frontend = frontend
        self._sight = sight
        self._make_predictor = make_predictor
        self._make_filter = make_filter
        self._prior = prior
        self._mount_sigma = mount_sigma
        self._rule = rule
        self._lost_after = lost_after
        self._rng: np.random.Generator | None = None
        self._before: _Seen[FrameT] | None = None

    def reset(self, observation: Observation, *, rng: np.random.Generator) -> PoseEstimate:
        """Start at pose zero, known exactly, with the first frame as keyframe."""
        self._rng = rng
        self._predictor = self._make_predictor(observation)
        self._filter = self._make_filter(self._predictor.errors)
        self._frontend.reset()
        self._last_seen = float(observation["stamp"][0])
        self._belief = Belief(self._filter, self._predictor.errors, self._last_seen)
        self._start_from(self._frontend.extract(observation), np.eye(4))
        self._check = DisparityCheck()
        self._failures = 0
        return PoseEstimate(
            pose=np.zeros(3),
            covariance=np.zeros((3, 3)),
            status=Status.TRACKING,
            stamp=self._last_seen,
            pose_3d=np.eye(4),
        )

    def update(self, observation: Observation) -> PoseEstimate:
        """Stereo, prediction, sight, filter, keyframe: one frame of Fig. 3.

        Raises:
            RuntimeError: `reset` was not called yet.
            ValueError: an observation that the front end or the predictor refuses.
        """
        if self._rng is None:
            raise RuntimeError("call reset() with the first observation before update()")
        clock = _Clock(started=time.perf_counter())
        frame = self._frontend.extract(observation)
        clock.extracted = time.perf_counter()
        increment = self._predict(observation)
        sight, expected = self._look(frame, increment)
        few = self._rule.sees_little(sight)
        if few and self._before is not None:
            increment = self._compare_with_the_frame_before(self._before, increment)
            sight, expected = self._look(frame, increment)
            few = self._rule.sees_little(sight)
        clock.looked = time.perf_counter()
        stamp = float(observation["stamp"][0])
        verdict = self._belief.judge(sight, increment, expected, stamp, few=few)
        self._learn(verdict)
        status = self._status(verdict.seen, stamp)
        told = self._tell(sight, verdict, clock) | {"features": float(len(frame.points))}
        now = _Seen(frame, sight, verdict, stamp)
        if self._outlived(sight, verdict):
            self._renew(now)
        else:
            self._before = None if verdict.seen is None or few else now
        state = verdict.fused.state
        return PoseEstimate(
            pose=state.pose.copy(),
            covariance=state.covariance[:3, :3].copy(),
            status=status,
            stamp=stamp,
            pose_3d=verdict.pose_3d.copy(),
            diagnostics=told,
        )

    def of_predictor(self) -> tuple[Array, Array]:
        """The predictor's constant errors as estimated (n,), and their covariance (n, n)."""
        return self._filter.of_predictor()

    def _renew(self, seen: _Seen[FrameT]) -> None:
        """The frame becomes the keyframe."""
        self._filter.commit(seen.verdict.fused)
        self._end_leg(seen.sight, seen.verdict.seen, seen.stamp)
        self._start_from(seen.frame, seen.verdict.pose_3d)

    def _compare_with_the_frame_before(
        self, before: _Seen[FrameT], increment: Increment
    ) -> Increment:
        """Little is seen of the keyframe any more, and most of the frame before: had it been known,
        that would be the keyframe. Returns the increment by the errors as estimated there."""
        biases, _ = self._filter.of_predictor()
        self._renew(before)
        return increment.corrected(self._filter.of_predictor()[0] - biases)

    def _start_from(self, frame: FrameT, pose_3d: Array) -> None:
        """Compare the next frames with this one."""
        self._keyframe = self._frontend.make_keyframe(frame)
        self._belief.start_from(pose_3d)
        self._before = None

    def _predict(self, observation: Observation) -> Increment:
        biases, _ = self._filter.of_predictor()
        increment = self._predictor.predict(observation, biases)
        if not increment.measured:  # a guess is uncertain enough
            return increment
        return self._on_slope(increment, self._belief.vertical)

    def _look(self, frame: FrameT, increment: Increment) -> tuple[Sight, Expectation]:
        """Back at the keyframe, from where the increment leads; and where that was expected."""
        assert self._rng is not None
        expected = self._belief.expect(increment)
        of_interest = self._keyframe, frame, expected, self._prior_of_motion(), self._rng
        sight = self._sight.look(*of_interest)
        if sight.motion is not None and self._rule.sees_little(sight):
            # Where tracks slip, what is sought where they lead is found there by chance.
            around = self._sight.look_around(*of_interest)
            sight = max(sight, around, key=lambda s: s.diagnostics["inliers"])
        return sight, expected

    def _prior_of_motion(self) -> MotionPrior:
        """Since the keyframe, from the prediction alone."""
        predicted = self._belief.predicted
        if predicted.measured:
            # The filter knows the constraint with all that correlates it; twice would be too often.
            return self._prior.about(pose_motion(predicted.pose), VAGUE_SIDE, self._mount_sigma)
        by_pose = pose_to_motion(predicted.pose)[2]
        side_sigma = float(np.sqrt(by_pose @ predicted.covariance @ by_pose))
        return self._prior.about(pose_motion(predicted.pose), side_sigma, self._mount_sigma)

    def _learn(self, verdict: Verdict) -> None:
        """How the robot moved, and whether vision fails."""
        if verdict.seen is not None:
            self._predictor.learn(verdict.moved)
        blind = verdict.seen is None and not verdict.stands
        self._failures = self._failures + 1 if blind else 0

    def _outlived(self, sight: Sight, verdict: Verdict) -> bool:
        """Whether the keyframe has served. While vision stands, it is the only one that is sure to
        be where it was."""
        frames, failures = self._belief.predicted.frames, self._failures
        replaced = self._rule.replaces(verdict.relative, sight, frames=frames, failures=failures)
        return replaced and not verdict.stands

    def _end_leg(self, sight: Sight, seen: RelativePose | None, stamp: float) -> None:
        """What the way from the last keyframe to the next tells of the cameras."""
        evidence = None if seen is None else self._sight.disparity_offset(sight)
        if evidence is not None and sight.support is not None:
            self._frontend.learn(sight.support.matches, evidence)
        self._check.take(evidence, self._filter)
        self._on_keyframe(Leg(stamp, seen, evidence))

    def _tell(self, sight: Sight, verdict: Verdict, clock: _Clock) -> dict[str, float]:
        """The diagnostics."""
        return {
            **sight.diagnostics,
            **self._check.diagnostics,
            **self._predictor.tell(*self._filter.of_predictor()),
            "nis": verdict.fused.nis,
            "slipped": float(verdict.fused.slipped),
            "stands_still": float(verdict.stands),
            "keyframe_age": float(self._belief.predicted.frames),
            "ms_stereo": 1e3 * (clock.extracted - clock.started),
            "ms_filter": 1e3 * (time.perf_counter() - clock.looked),
        }

    def _status(self, seen: RelativePose | None, stamp: float) -> Status:
        if seen is not None:
            self._last_seen = stamp
            return Status.TRACKING
        if not self._belief.predicted.measured and stamp - self._last_seen > self._lost_after:
            self._predictor.learn(None)
            return Status.LOST
        return Status.COASTING
