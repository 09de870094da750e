"""The filters' step in time, the same whatever their landmarks are."""

from collections.abc import Callable

import numpy as np

from grouser.estimators.base import Observation
from grouser.estimators.line_slam.motion import MotionModel, Step
from grouser.estimators.line_slam.sparse_update import propagate
from grouser.estimators.line_slam.state import POSE, LineState
from grouser.geometry import Array
from grouser.kernels import kernel_using


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
    _spread(
        state.buffer,
        state.size,
        by_pose(step),
        step.by_errors,
        step.covariance,
        motion.errors.walks,
    )
    state.pose[:] = step.pose
    return step.measured


@kernel_using(propagate)
def _spread(
    P: Array, n: int, by_pose: Array, by_errors: Array, covariance: Array, walks: Array
) -> None:
    """`propagate` for the pose and the constant errors, which wander."""
    head = POSE + len(walks)
    F, Q = np.eye(head), np.zeros((head, head))
    F[:POSE, :POSE], F[:POSE, POSE:] = by_pose, by_errors
    Q[:POSE, :POSE] = covariance
    for k in range(len(walks)):
        Q[POSE + k, POSE + k] = walks[k] ** 2
    propagate(P, n, F, Q)
