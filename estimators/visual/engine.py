"""Paper 1's Fig. 3 on keyframes (SPEC 1.5), wherever the frames come from."""

import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Generic

import numpy as np

from grouser.estimators.base import Observation, PoseEstimate, Status
from grouser.estimators.visual.base import FrameT, Frontend, KeyframeT
from grouser.estimators.visual.constant_errors import ConstantErrors
from grouser.estimators.visual.disparity_check import DisparityCheck
from grouser.estimators.visual.fusion import Fused, RelativePose, nothing_yet
from grouser.estimators.visual.glimpses import Glimpses
from grouser.estimators.visual.keyframes import KeyframeRule
from grouser.estimators.visual.last_sight import LastSight
from grouser.estimators.visual.levelling import levelling
from grouser.estimators.visual.motion import chassis_pose
from grouser.estimators.visual.planar_motion import pose_motion, pose_to_motion
from grouser.estimators.visual.pose_filter import PoseFilter
from grouser.estimators.visual.prediction import Increment, MotionPredictor
from grouser.estimators.visual.prior import VAGUE_SIDE, ChassisPrior, MotionPrior
from grouser.estimators.visual.sight import Expectation, KeyframeSight, Sight
from grouser.estimators.visual.single_pose import (
    between,
    carried,
    compose,
    compose_jacobians,
)
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
class _Weighed:
    """What may be believed of a sight, before it is compared with the tracks."""

    seen: RelativePose | None
    """None where vision fails, stands, or fits by chance."""
    stands: bool
    """No motion is seen where the tracks measured one."""
    doubtful: bool
    """Few points, which agree no better than wrong ones may."""
    level: Array
    """(3,) what the keyframe's tilt adds to all that is seen from it"""


@dataclass(frozen=True, slots=True)
class _Seen(Generic[FrameT]):
    """A frame that was seen well: all that makes it the keyframe."""

    frame: FrameT
    pose_3d: Array
    fused: Fused
    sight: Sight
    seen: RelativePose | None
    """None where it is the keyframe although vision failed"""
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
        self._glimpses = Glimpses()
        self._start_from(self._frontend.extract(observation), np.eye(4))
        self._check = DisparityCheck()
        self._doubtful = self._stood = False
        self._moved = np.zeros(3)
        self._failures = 0
        self._last_seen = self._looked_at = float(observation["stamp"][0])
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
        if self._before is not None and self._rule.sees_little(sight):
            increment = self._compare_with_the_frame_before(self._before, increment)
            sight, expected = self._look(frame, increment)
        clock.looked = time.perf_counter()
        stamp = float(observation["stamp"][0])
        weighed = self._weigh(sight, increment, stamp)
        seen, fused = self._combine(weighed)
        relative, pose_3d = self._place(fused, seen, sight, weighed.level)
        if weighed.stands:
            self._expect_rest(increment)
        else:
            self._learn(relative, seen, expected, slipped=fused.slipped)
        if seen is not None:
            self._filter.believe(fused, seen, self._predicted.frames)
            self._last_sight = self._seen_here(relative, pose_3d, fused)
        status = self._status(seen, stamp)
        told = self._tell(sight, weighed, fused, clock) | {"features": float(len(frame.points))}
        now = _Seen(frame, pose_3d.copy(), fused, sight, seen, stamp)
        if self._outlived(relative, sight, weighed):
            self._renew(now)
        else:
            well = seen is not None and not self._rule.sees_little(sight)
            self._before = now if well else None
        return PoseEstimate(
            pose=fused.state.pose.copy(),
            covariance=fused.state.covariance[:3, :3].copy(),
            status=status,
            stamp=stamp,
            pose_3d=pose_3d,
            diagnostics=told,
        )

    def of_predictor(self) -> tuple[Array, Array]:
        """The predictor's constant errors as estimated (n,), and their covariance (n, n)."""
        return self._filter.of_predictor()

    def _renew(self, seen: _Seen[FrameT]) -> None:
        """The frame becomes the keyframe."""
        self._filter.commit(seen.fused)
        self._end_leg(seen.sight, seen.seen, seen.stamp)
        self._start_from(seen.frame, seen.pose_3d)

    def _compare_with_the_frame_before(
        self, before: _Seen[FrameT], increment: Increment
    ) -> Increment:
        """Little is seen of the keyframe any more, and most of the frame before: had it been known,
        that would be the keyframe. Returns the increment by the errors as estimated there."""
        biases, _ = self._filter.of_predictor()
        self._renew(before)
        changed = self._filter.of_predictor()[0] - biases
        return replace(increment, pose=increment.pose + increment.by_biases @ changed)

    def _start_from(self, frame: FrameT, pose_3d: Array) -> None:
        """Compare the next frames with this one."""
        self._keyframe = self._frontend.make_keyframe(frame)
        self._keyframe_pose_3d = pose_3d
        self._predicted = nothing_yet(self._predictor.errors)
        self._last_sight = self._at_keyframe()
        self._believed = Expectation(np.zeros(3), np.zeros((3, 3)))
        self._glimpses.start()
        self._before = None

    def _at_keyframe(self) -> LastSight:
        return LastSight(np.zeros(3), self._keyframe_pose_3d, self._predicted)

    def _seen_here(self, relative: Array, pose_3d: Array, fused: Fused) -> LastSight:
        nothing = nothing_yet(self._predictor.errors)
        return LastSight(relative, pose_3d.copy(), nothing, fused.state)

    def _predict(self, observation: Observation) -> Increment:
        biases, _ = self._filter.of_predictor()
        increment = self._predictor.predict(observation, biases)
        if not increment.measured:  # a guess is uncertain enough
            return increment
        return self._on_slope(increment, self._last_sight.vertical)

    def _look(self, frame: FrameT, increment: Increment) -> tuple[Sight, Expectation]:
        """Back at the keyframe, from where the increment leads; and where that was expected."""
        assert self._rng is not None
        expected = self._expect(increment)
        of_interest = self._keyframe, frame, expected, self._believe(), self._rng
        sight = self._sight.look(*of_interest)
        if sight.motion is not None and self._rule.sees_little(sight):
            # Where tracks slip, what is sought where they lead is found there by chance.
            around = self._sight.look_around(*of_interest)
            sight = max(sight, around, key=lambda s: s.diagnostics["inliers"])
        return sight, expected

    def _expect(self, increment: Increment) -> Expectation:
        """Takes the increment into the filter's prediction, and says where to search."""
        _, covariance_of_biases = self._filter.of_predictor()
        self._predicted = self._predicted.then(increment)
        self._last_sight = self._last_sight.then(increment)
        F, V = compose_jacobians(self._believed.pose, increment.pose)
        by_biases = increment.by_biases
        noise = increment.covariance + by_biases @ covariance_of_biases @ by_biases.T
        covariance = carried(F, self._believed.covariance, V, noise)
        return Expectation(compose(self._believed.pose, increment.pose), covariance)

    def _believe(self) -> MotionPrior:
        """The prior of the motion since the keyframe, from the prediction alone."""
        predicted = self._predicted
        if self._predicted.measured:
            # The filter knows the constraint with all that correlates it; twice would be too often.
            return self._prior.about(pose_motion(predicted.pose), VAGUE_SIDE, self._mount_sigma)
        by_pose = pose_to_motion(predicted.pose)[2]
        side_sigma = float(np.sqrt(by_pose @ predicted.covariance @ by_pose))
        return self._prior.about(pose_motion(predicted.pose), side_sigma, self._mount_sigma)

    def _level(self, glimpse: RelativePose | None, sight: Sight) -> Array:
        """(3,) what the keyframe's tilt adds to all that is seen from it."""
        level = np.empty(3)
        height, _, pitch = sight.out_of_plane()
        seen = self._predicted if glimpse is None else glimpse
        levelling(self._keyframe_pose_3d, seen.pose, height, pitch, level)
        return level

    def _weigh(self, sight: Sight, increment: Increment, stamp: float) -> _Weighed:
        """What of a sight may be believed, by itself and by the sight before."""
        glimpse = None if sight.motion is None else sight.planar()
        few = self._rule.sees_little(sight)
        doubtful = few and sight.fits_by_chance
        duration, self._looked_at = stamp - self._looked_at, stamp
        if glimpse is not None and doubtful and increment.measured:
            # Points that agree by chance lead anywhere; where no robot comes is not where it is.
            ways = increment.pose, self._moved
            glimpse = None if self._glimpses.leaps(glimpse.pose, duration, *ways) else glimpse
        self._glimpses.take(glimpse, duration)
        stands = self._glimpses.stand(increment)
        # After standing, everything may be elsewhere: a few matches then are found by chance.
        # So they are where they fit as chance does, unless the tracks say the same.
        chance = (few and self._stood) or (doubtful and not self._predicted.measured)
        seen = None if stands or chance else glimpse
        self._stood = stands or (self._stood and seen is None)
        return _Weighed(seen, stands, doubtful, self._level(glimpse, sight))

    def _combine(self, weighed: _Weighed) -> tuple[RelativePose | None, Fused]:
        """What is believed of vision beside the tracks, and the state with it."""
        level, before = weighed.level, self._doubtful
        fused = self._fuse(weighed.seen, weighed.stands, level)
        if fused.slipped and self._glimpses.jump():
            # Points were mistaken for others, which says nothing against the tracks.
            self._doubtful = before
            return None, self._bridge()
        if fused.slipped and weighed.doubtful:
            # Against the tracks: neither is sure, both are covered.
            return None, self._doubt(self._glimpses.last.pose)
        if weighed.seen is not None and weighed.doubtful:
            # They agree by chance, and with the tracks because they were looked for there.
            self._doubtful = before
            return None, self._bridge()
        if fused.slipped and weighed.seen is not None:
            # Tracks tell nothing then, but a mass keeps its motion, whatever they do.
            seen = self._glimpses.steadied(weighed.seen)
            return seen, self._fuse(seen, weighed.stands, level)
        return weighed.seen, fused

    def _fuse(self, seen: RelativePose | None, stands: bool, level: Array) -> Fused:
        self._doubtful |= stands
        if seen is None:
            return self._bridge()
        predicted = self._predicted.shifted(level)
        seen = seen.shifted(level)
        if not predicted.measured:
            return self._filter.follow(seen, predicted.frames)
        fused = self._filter.fuse(predicted, seen)
        self._doubtful = fused.slipped
        return fused

    def _bridge(self) -> Fused:
        """By the prediction; if that was wrong of late, the robot may as well have gone on as it
        was seen to go, or stand where it was seen to stand."""
        if self._doubtful:
            return self._doubt(self._glimpses.going_on())
        known = self._last_known()
        return self._filter.coast(known.since.shifted(known.level()), known.state)

    def _doubt(self, anchor: Array) -> Fused:
        known = self._last_known()
        level = known.level()
        anchor = between(known.pose, anchor) + level
        return self._filter.doubt(known.since.shifted(level), anchor, known.state)

    def _last_known(self) -> LastSight:
        """From where the prediction alone leads on."""
        # Who was said to stand may have moved all the while since the keyframe.
        return self._at_keyframe() if self._stood else self._last_sight

    def _place(
        self, fused: Fused, seen: RelativePose | None, sight: Sight, level: Array
    ) -> tuple[Array, Array]:
        """(3,) where the robot is as seen from the keyframe, in its plane, and (4, 4) from the
        start, with the tilt that was seen, or seen last."""
        if seen is not None:
            relative = self._filter.relative(fused) - level
            return relative, self._keyframe_pose_3d @ chassis_pose(relative, *sight.out_of_plane())
        known = self._last_known()
        step = self._filter.relative(fused, known.state) - known.level()
        return compose(known.pose, step), known.pose_3d @ chassis_pose(step, 0.0, 0.0, 0.0)

    def _learn(
        self, relative: Array, seen: RelativePose | None, expected: Expectation, *, slipped: bool
    ) -> None:
        """What the next prediction starts from, and what the next sight is measured by."""
        self._moved = between(self._believed.pose, relative)
        if seen is None:
            self._failures += 1
            self._believed = Expectation(relative, expected.covariance)
        else:
            self._failures = 0
            self._predictor.learn(self._moved)
            self._believed = Expectation(relative, seen.covariance)
            # Vision and tracks together are as sure as the surer one, at least.
            surer = not slipped and expected.covariance.trace() < seen.covariance.trace()
            covariance = expected.covariance if surer else seen.covariance
            self._glimpses.believe(Expectation(relative, covariance))

    def _expect_rest(self, increment: Increment) -> None:
        """The next frame may go on standing, or come to where the tracks say."""
        either = np.diag(increment.pose**2) + increment.covariance
        self._believed = Expectation(self._glimpses.last.pose, either)
        self._glimpses.believe(self._glimpses.last)
        self._failures = 0

    def _outlived(self, relative: Array, sight: Sight, weighed: _Weighed) -> bool:
        """Whether the keyframe has served. While vision stands, it is the only one that is sure to
        be where it was."""
        frames, failures = self._predicted.frames, self._failures
        replaced = self._rule.replaces(relative, sight, frames=frames, failures=failures)
        return replaced and not weighed.stands

    def _end_leg(self, sight: Sight, seen: RelativePose | None, stamp: float) -> None:
        """What the way from the last keyframe to the next tells of the cameras."""
        evidence = None if seen is None else self._sight.disparity_offset(sight)
        if evidence is not None and sight.support is not None:
            self._frontend.learn(sight.support.matches, evidence)
        self._check.take(evidence, self._filter)
        self._on_keyframe(Leg(stamp, seen, evidence))

    def _tell(
        self, sight: Sight, weighed: _Weighed, fused: Fused, clock: _Clock
    ) -> dict[str, float]:
        """The diagnostics."""
        return {
            **sight.diagnostics,
            **self._check.diagnostics,
            **self._predictor.tell(*self._filter.of_predictor()),
            "nis": fused.nis,
            "slipped": float(fused.slipped),
            "stands_still": float(weighed.stands),
            "keyframe_age": float(self._predicted.frames),
            "ms_stereo": 1e3 * (clock.extracted - clock.started),
            "ms_filter": 1e3 * (time.perf_counter() - clock.looked),
        }

    def _status(self, seen: RelativePose | None, stamp: float) -> Status:
        if seen is not None:
            self._last_seen = stamp
            return Status.TRACKING
        if not self._predicted.measured and stamp - self._last_seen > self._lost_after:
            self._predictor.learn(None)
            return Status.LOST
        return Status.COASTING
