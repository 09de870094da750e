"""The filters' step in time, the same whatever their landmarks are."""

from collections.abc import Callable

import numpy as np

from grouser.estimators.base import Observation
from grouser.estimators.line_slam.motion import MotionModel, Step
from grouser.estimators.line_slam.sparse_update import propagate
from grouser.estimators.line_slam.state import POSE, LineState
from grouser.geometry import Array


def predict(
    state: LineState,
    motion: MotionModel,
    observation: Observation,
    by_pose: Callable[[Step], Array],
) -> bool:
    """Move the pose, and spread its covariance; whether the motion was measured.

    Args:
        by_pose: the derivative (3, 3) of the pose after the step by the one before it, which the
            state still has when it is asked for.
    """
    step = motion.predict(observation, state.pose.copy(), state.errors.copy())
    F, Q = np.eye(state.head), np.zeros((state.head, state.head))
    F[:POSE, :POSE] = by_pose(step)
    F[:POSE, POSE:] = step.by_errors
    Q[:POSE, :POSE] = step.covariance
    Q[POSE:, POSE:] = np.diag(motion.errors.walks**2)
    propagate(state.buffer, state.size, F, Q)
    state.pose[:] = step.pose
    return step.measured
