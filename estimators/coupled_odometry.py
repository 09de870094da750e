"""Whatever predicts, corrected by another estimator's motion, a gyroscope and satellite fixes."""

import copy
from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np

from grouser.checks import require_positive
from grouser.estimators.base import Observation, PoseEstimate, Status
from grouser.estimators.gyro import Gyro
from grouser.estimators.joint_filter import POSITION_GATE, Heard, JointFilter, JointFused
from grouser.estimators.pose_source import PoseSource
from grouser.estimators.position_fixes import PositionFixes
from grouser.estimators.visual.fusion import RelativePose, nothing_yet
from grouser.estimators.visual.prediction import Increment, MotionPredictor
from grouser.estimators.visual.sight import Expectation
from grouser.estimators.visual.stillness import contradicted, doubt
from grouser.geometry import Array, between, exp, log
from grouser.rig import Rig


@dataclass(frozen=True, slots=True)
class CouplingOptions:
    """When what the source says is taken into account for good, and for how long a fix counts."""

    anchor_distance: float = 0.25
    """m"""
    anchor_turn: float = 0.2
    """rad"""
    fix_lasts: float = 1.0
    """s for which a fix supports the estimate"""
    lost_after: float = np.inf
    """s without a source, a fix or tracks until the pose is LOST"""

    def __post_init__(self) -> None:
        require_positive(self, "anchor_distance", "anchor_turn", "fix_lasts")


class CoupledOdometry:
    """Predict, hear gyroscope and receiver, and look where the source says that the robot is.

    TRACKING where the source tracks or a fix is young, else COASTING, and LOST where that
    lasts and nothing measures the increments. All that it is shown belongs to now.
    """

    def __init__(
        self,
        rig: Rig,
        *,
        make_parts: Callable[[Observation], tuple[MotionPredictor, Gyro | None]],
        source: PoseSource | None,
        use_gps: bool,
        options: CouplingOptions,
    ) -> None:
        self._make_parts = make_parts
        self._source = source
        self._gps, self._dt = rig.gps if use_gps else None, rig.dt
        self._options = options
        self._filter: JointFilter | None = None

    def reset(self, observation: Observation, *, rng: np.random.Generator) -> PoseEstimate:
        """Start at pose zero, known exactly.

        Raises:
            ValueError: the observation lacks what the source requires.
        """
        self._predictor, gyro = self._make_parts(observation)
        self._filter = JointFilter(
            self._predictor.errors,
            gyro=gyro,
            fixes=PositionFixes(self._gps) if self._gps and "gps" in observation else None,
        )
        self._filter.reset(observation)
        self._fixed_at, self._supported_at = -np.inf, float(observation["stamp"][0])
        if self._source:
            self._source.reset(observation, rng=rng)
        self._sourced = self._source is not None
        self._way = nothing_yet(self._predictor.errors)
        self._seen, self._stood = Expectation(np.zeros(3), np.zeros((3, 3))), 0
        status = Status.TRACKING if self._sourced else Status.COASTING
        self._fused = self._filter.coast()
        return self._estimate(observation, self._fused, Heard(), status)

    def update(self, observation: Observation) -> PoseEstimate:
        """Take the next observation.

        Raises:
            RuntimeError: `reset` was not called yet.
            ValueError: the predictor or the source refuses what it is shown.
        """
        if self._filter is None:
            raise RuntimeError("call reset() with the first observation before update()")
        heard = self._go_on(self._filter, observation)
        before = self._fused.state.pose
        self._fused, self._sourced = self._look(self._filter, observation, heard)
        if self._sourced:
            moved = between(before, self._fused.state.pose)
            self._predictor.learn(exp(log(moved) / self._way.frames))
        self._way = nothing_yet(self._predictor.errors)
        status = self._status(float(observation["stamp"][0]), heard)
        return self._estimate(observation, self._fused, heard, status)

    @property
    def eyes(self) -> tuple[str, ...]:
        """The images that the source sees."""
        return self._source.eyes if self._source else ()

    def pass_by(self, observation: Observation) -> Heard:
        """Take an observation that the source is not shown, because it waits for a later one.

        Raises:
            RuntimeError: `reset` was not called yet.
            ValueError: the predictor refuses what it is shown.
        """
        if self._filter is None:
            raise RuntimeError("call reset() with the first observation before pass_by()")
        return self._go_on(self._filter, observation)

    def led_on(self, observations: Iterable[Observation]) -> PoseEstimate:
        """The estimate after at least one more observation of which the source sees nothing yet.

        Nothing is kept of them.
        """
        ahead = copy.copy(self)
        ahead._filter, ahead._predictor = copy.deepcopy((self._filter, self._predictor))
        assert ahead._filter is not None
        ahead._filter.resume(self._fused.state)
        for observation in observations:
            heard = ahead.pass_by(observation)
            status = ahead._status(float(observation["stamp"][0]), heard)
        return ahead._estimate(observation, ahead._filter.coast(), heard, status)

    def _go_on(self, joint: JointFilter, observation: Observation) -> Heard:
        """By what is predicted and heard."""
        biases, _ = joint.of_predictor()
        increment = self._predictor.predict(observation, biases)
        self._measured = self._predictor.measures and increment.measured
        self._way = self._way.then(increment)
        joint.predict(increment)
        return joint.hear(observation, blind=not self._sourced)

    def _look(
        self, joint: JointFilter, observation: Observation, heard: Heard
    ) -> tuple[JointFused, bool]:
        """The estimate with the source's motion, and whether there was one."""
        if self._source is None or not self._source.update(observation):
            return self._without_source(joint), False
        pose, covariance = self._source.relative()
        way = self._way
        increment = Increment(
            way.pose, way.covariance, way.by_biases, self._predictor.measures and way.measured
        )
        if self._stands(pose, covariance, increment):
            joint.predict(doubt(increment, self._stood))
            return joint.coast(), False
        seen = RelativePose(pose, covariance, by_disparity=np.zeros(3))
        if joint.disbelieves(seen, alone=heard.slipped or not self._measured):
            self._source.anchor()
            return self._without_source(joint), False
        fused = joint.fuse(seen)
        moved = fused.state.relative
        far = np.hypot(moved[0], moved[1]) > self._options.anchor_distance
        if far or abs(moved[2]) > self._options.anchor_turn:
            joint.commit(fused)
            self._source.anchor()
            self._seen = Expectation(np.zeros(3), np.zeros((3, 3)))
        return fused, True

    def _without_source(self, joint: JointFilter) -> JointFused:
        self._seen, self._stood = Expectation(np.zeros(3), np.zeros((3, 3))), 0
        fused = joint.coast()
        joint.commit(fused)  # there is no motion that a later one would have to replace
        return fused

    def _stands(self, pose: Array, covariance: Array, increment: Increment) -> bool:
        """Whether the source saw no motion since the last frame where the tracks measured one."""
        before, self._seen = self._seen, Expectation(pose, covariance)
        step, noise = between(before.pose, pose), before.covariance + covariance
        stands = contradicted(step, noise, increment)
        self._stood = self._stood + 1 if stands else 0
        return stands

    def _status(self, now: float, heard: Heard) -> Status:
        if heard.fixed:
            self._fixed_at = now
        if self._sourced or now - self._fixed_at < self._options.fix_lasts + self._dt / 2:
            self._supported_at = now
            return Status.TRACKING
        blind = now - self._supported_at > self._options.lost_after
        return Status.LOST if blind and not self._measured else Status.COASTING

    def _estimate(
        self, observation: Observation, fused: JointFused, heard: Heard, status: Status
    ) -> PoseEstimate:
        assert self._filter is not None
        n, state = len(self._predictor.errors), fused.state
        bias, bias_sigma = self._filter.gyro_bias
        diagnostics = {
            **self._predictor.tell(state.biases[:n], state.bias_covariance[:n, :n]),
            "gyro_bias": bias,
            "gyro_bias_sigma": bias_sigma,
            "nis": fused.nis,
            "slipped": float(fused.slipped or heard.slipped),
            "fix_rejected": float(heard.fix_nis > POSITION_GATE),
        }
        return PoseEstimate(
            pose=state.pose.copy(),
            covariance=state.pose_covariance,
            status=status,
            stamp=float(observation["stamp"][0]),
            diagnostics=diagnostics,
        )
