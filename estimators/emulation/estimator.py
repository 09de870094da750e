"""An estimator that is not one: the true pose with errors like those of a real estimator."""

from typing import ClassVar

import numpy as np

from grouser.estimators.base import Observation, PoseEstimate, PoseEstimator, Status
from grouser.estimators.emulation.error_model import STATUSES
from grouser.estimators.emulation.model_file import load_model
from grouser.estimators.emulation.process import ErrorProcess, seen_from
from grouser.geometry import Array
from grouser.rig import Rig


class Emulated(PoseEstimator):
    """The true pose with errors drawn from a model of a real estimator's: for fast training.

    It reads the truth, which it and ground-truth alone may: what it tells is no estimate, but a
    draw from the errors that `of` makes. Train under it, and evaluate with the estimator itself.
    Errors do not depend on what the robot sees, only on how it drives and on chance.
    """

    requires: ClassVar[frozenset[str]] = frozenset({"true_pose", "stamp"})

    def __init__(self, rig: Rig, *, of: str = "ekf-line-slam") -> None:
        """
        Args:
            rig: the robot's; its time step must be the model's.
            of: estimator whose errors to draw: a name of `emulation.model_file.fitted_names()`, or
                a JSON file that `grouser fit-emulator` made.

        Raises:
            ValueError: there is no such model, or it was fitted to steps of another length.
        """
        self._model = load_model(of)
        if abs(self._model.dt - rig.dt) > 1e-6:
            raise ValueError(
                f"the emulator of {of!r} was fitted to steps of {self._model.dt:g} s, and this "
                f"robot's take {rig.dt:g} s; fit one to runs of this robot"
            )
        self._chances = np.cumsum(self._model.transitions, axis=1)
        self._process: ErrorProcess | None = None

    def reset(self, observation: Observation, *, rng: np.random.Generator) -> PoseEstimate:
        """Take the present pose for the frame of all that follow, and draw the episode's errors."""
        model = self._model
        self._rng = rng
        self._start = np.array(observation["true_pose"], dtype=np.float64)
        bias = model.bias_mean + model.bias_sigma * rng.standard_normal((2, 3, 4))
        self._process = ErrorProcess(model, bias, np.zeros(3))
        self._status = _drawn(np.cumsum(model.first_status), rng)
        return self._told(observation, np.zeros(3), np.zeros((3, 3)))

    def update(self, observation: Observation) -> PoseEstimate:
        """The pose at this stamp, with the errors so far.

        Raises:
            RuntimeError: `reset` was not called yet.
        """
        if self._process is None:
            raise RuntimeError("call reset() with the first observation before update()")
        self._status = _drawn(self._chances[self._status], self._rng)
        truth = np.empty(3)
        seen_from(self._start, observation["true_pose"], truth)
        pose, covariance = self._process.step(truth, self._status, self._rng.standard_normal(6))
        return self._told(observation, pose, covariance)

    def _told(self, observation: Observation, pose: Array, covariance: Array) -> PoseEstimate:
        status: Status = STATUSES[self._status]
        return PoseEstimate(pose, covariance, status, float(observation["stamp"][0]))


def _drawn(cumulated: Array, rng: np.random.Generator) -> int:
    """An index by cumulated probabilities."""
    return min(int(np.searchsorted(cumulated, rng.random(), side="right")), len(STATUSES) - 1)
