"""What is believed of what is seen and of what is predicted, and where the robot is by it.

Vision may be wrong, or stand still, or fail; tracks may slip. What one says against the other, and
against what was seen before, decides which of them is believed, or that neither is.
"""

from dataclasses import dataclass

import numpy as np

from grouser.estimators.visual.constant_errors import ConstantErrors
from grouser.estimators.visual.fusion import Accumulated, Fused, RelativePose, nothing_yet
from grouser.estimators.visual.glimpses import Glimpses
from grouser.estimators.visual.last_sight import LastSight
from grouser.estimators.visual.levelling import levelling
from grouser.estimators.visual.motion import chassis_pose
from grouser.estimators.visual.pose_filter import PoseFilter
from grouser.estimators.visual.prediction import Increment
from grouser.estimators.visual.sight import Expectation, Sight
from grouser.estimators.visual.single_pose import between, carried, compose, compose_jacobians
from grouser.geometry import Array


@dataclass(frozen=True, slots=True)
class Verdict:
    """What is believed in the end."""

    seen: RelativePose | None
    """By vision; None where it fails, or is not believed."""
    stands: bool
    """No motion is seen where the tracks measured one."""
    fused: Fused
    """The state"""
    relative: Array
    """(3,) where the robot is as seen from the keyframe, in the keyframe's plane"""
    moved: Array
    """(3,) and as seen from where it was a frame before"""
    pose_3d: Array
    """(4, 4) as seen from the start"""


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


class Belief:
    """Since the keyframe; and, from keyframe to keyframe, whether tracks and vision are doubted."""

    def __init__(self, kalman: PoseFilter, errors: ConstantErrors, stamp: float) -> None:
        """
        Args:
            kalman: fuses what is believed; whoever commits to a keyframe also calls `start_from`.
            errors: the predictor's.
            stamp: of the first frame, s.
        """
        self._filter, self._errors = kalman, errors
        self._glimpses = Glimpses()
        self._doubtful = self._stood = False
        self._moved = np.zeros(3)
        self._looked_at = stamp
        self.start_from(np.eye(4))

    def start_from(self, pose_3d: Array) -> None:
        """From a new keyframe on, whose pose is (4, 4)."""
        self._keyframe_pose_3d = pose_3d
        self.predicted: Accumulated = nothing_yet(self._errors)
        self._last_sight = self._at_keyframe()
        self._believed = Expectation(np.zeros(3), np.zeros((3, 3)))
        self._glimpses.start()

    @property
    def vertical(self) -> Array:
        """(3,) up, as the robot was last seen to lean, were it level at the start."""
        return self._last_sight.vertical

    def expect(self, increment: Increment) -> Expectation:
        """Takes the increment into the filter's prediction, and says where to search."""
        _, covariance_of_biases = self._filter.of_predictor()
        self.predicted = self.predicted.then(increment)
        self._last_sight = self._last_sight.then(increment)
        F, V = compose_jacobians(self._believed.pose, increment.pose)
        by_biases = increment.by_biases
        noise = increment.covariance + by_biases @ covariance_of_biases @ by_biases.T
        covariance = carried(F, self._believed.covariance, V, noise)
        return Expectation(compose(self._believed.pose, increment.pose), covariance)

    def judge(
        self, sight: Sight, increment: Increment, expected: Expectation, stamp: float, *, few: bool
    ) -> Verdict:
        """Weigh a sight against the sight before and the tracks, place the robot by what is
        believed of them, and learn from it.

        Args:
            increment: what was predicted, to where it was `expect`ed.
            few: the sight is of few points.
        """
        weighed = self._weigh(sight, increment, stamp, few)
        seen, fused = self._combine(weighed)
        relative, pose_3d = self._place(fused, seen, sight, weighed.level)
        if weighed.stands:
            self._expect_rest(increment)
        else:
            self._learn(relative, seen, expected, slipped=fused.slipped)
        if seen is not None:
            self._filter.believe(fused, seen, self.predicted.frames)
            nothing = nothing_yet(self._errors)
            self._last_sight = LastSight(relative, pose_3d, nothing, fused.state)
        return Verdict(seen, weighed.stands, fused, relative, self._moved, pose_3d)

    def _weigh(self, sight: Sight, increment: Increment, stamp: float, few: bool) -> _Weighed:
        """What of a sight may be believed, by itself and by the sight before."""
        glimpse = None if sight.motion is None else sight.planar()
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
        chance = (few and self._stood) or (doubtful and not self.predicted.measured)
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
            self._believed = Expectation(relative, expected.covariance)
        else:
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

    def _fuse(self, seen: RelativePose | None, stands: bool, level: Array) -> Fused:
        self._doubtful |= stands
        if seen is None:
            return self._bridge()
        predicted = self.predicted.shifted(level)
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

    def _at_keyframe(self) -> LastSight:
        return LastSight(np.zeros(3), self._keyframe_pose_3d, self.predicted)

    def _level(self, glimpse: RelativePose | None, sight: Sight) -> Array:
        """(3,) what the keyframe's tilt adds to all that is seen from it."""
        level = np.empty(3)
        height, _, pitch = sight.out_of_plane()
        seen = self.predicted if glimpse is None else glimpse
        levelling(self._keyframe_pose_3d, seen.pose, height, pitch, level)
        return level
