"""Does vision stand still while the tracks move? They slip in full, or the camera is stuck."""

import math

import numpy as np

from grouser.estimators.visual.fusion import SLIP_GATE
from grouser.estimators.visual.prediction import Increment
from grouser.estimators.visual.single_pose import wrapped
from grouser.geometry import Array
from grouser.kernels import kernel_using

_LEAST_WAY, _LEAST_TURN = 0.01, 0.02  # m, rad a frame: less is too little to tell
_SHARE = 0.1  # of what the tracks say: so little is rest
_REST = 1e-3  # m, rad a frame: the noise of vision at rest


def contradicted(step: Array, noise: Array, increment: Increment) -> bool:
    """Whether vision sees no motion (3,) over a frame in which the tracks measured one.

    noise: (3, 3) covariance of what vision sees; a short step may be lost in it.
    """
    if not increment.measured:
        return False
    return bool(_stands(step, increment.pose, noise + increment.covariance))


def moves(expected: Array) -> bool:
    """Whether a motion (3,) over a frame is so large that vision would see that it was not."""
    return bool(_moves(expected))


def doubt(increment: Increment, frames: int) -> Increment:
    """The noise of a motion (3,) that may not have been, for the n-th frame in a row.

    Both stay possible from frame to frame: such errors add up, not their squares.
    """
    way, turn = _lengths(increment.pose)
    spread = (2 * frames - 1) * np.diag([way, way, turn]) ** 2
    return Increment(np.zeros(3), spread, np.zeros_like(increment.by_biases))


def _lengths(pose: Array) -> tuple[float, float]:
    """How far it is, m, and how much it turns, rad."""
    return math.hypot(pose[0], pose[1]), abs(float(wrapped(pose[2])))


@kernel_using(wrapped)
def _moves(expected: Array) -> bool:
    way, turn = math.hypot(expected[0], expected[1]), abs(wrapped(expected[2]))
    return bool(way > _LEAST_WAY or turn > _LEAST_TURN)


@kernel_using(_moves, wrapped)
def _stands(step: Array, expected: Array, covariance: Array) -> bool:
    if not _moves(expected):
        return False
    way, turn = math.hypot(expected[0], expected[1]), abs(wrapped(expected[2]))
    if math.hypot(step[0], step[1]) > _REST + _SHARE * way:
        return False
    if abs(wrapped(step[2])) > _REST + _SHARE * turn:
        return False
    missing = expected - step
    missing[2] = wrapped(missing[2])
    return bool(missing @ np.linalg.solve(covariance, missing) > SLIP_GATE)
