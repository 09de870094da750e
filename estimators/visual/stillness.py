"""Does vision stand still while the tracks move? They slip in full, or the camera is stuck."""

import numpy as np

from grouser.estimators.visual.prediction import Increment
from grouser.geometry import Array, wrap

_MOVES = np.array([0.01, 0.02])  # m, rad a frame: less is too little to tell
_SHARE = 0.1  # of what the tracks say: so little is rest
_REST = np.array([1e-3, 1e-3])  # m, rad a frame: the noise of vision at rest
_GATE = 16.3  # chi-square of 3 degrees of freedom at 99.9 %


def contradicted(step: Array, noise: Array, increment: Increment) -> bool:
    """Whether vision sees no motion (3,) over a frame in which the tracks measured one.

    noise: (3, 3) covariance of what vision sees; a short step may be lost in it.
    """
    if not increment.measured:
        return False
    expected, seen = _lengths(increment.pose), _lengths(step)
    if not ((expected > _MOVES).any() and (seen <= _REST + _SHARE * expected).all()):
        return False
    missing = increment.pose - step
    missing[2] = float(wrap(missing[2]))
    return bool(missing @ np.linalg.solve(noise + increment.covariance, missing) > _GATE)


def _lengths(pose: Array) -> Array:
    """(2,) how far it is, m, and how much it turns, rad."""
    return np.array([np.hypot(pose[0], pose[1]), abs(float(wrap(pose[2])))])
