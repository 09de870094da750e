"""Does vision stand still while the tracks move? They slip in full, or the camera is stuck."""

import numpy as np

from grouser.estimators.visual.prediction import Increment
from grouser.geometry import Array, wrap

_MOVES = np.array([0.01, 0.02])  # m, rad a frame: less is too little to tell
_SHARE = 0.1  # of what the tracks say: so little is rest
_REST = np.array([1e-3, 1e-3])  # m, rad a frame: the noise of vision at rest


def contradicted(step: Array, increment: Increment) -> bool:
    """Whether vision sees no motion (3,) over a frame in which the tracks measured one."""
    if not increment.measured:
        return False
    expected, seen = _lengths(increment.pose), _lengths(step)
    return bool((expected > _MOVES).any() and (seen <= _REST + _SHARE * expected).all())


def _lengths(pose: Array) -> Array:
    """(2,) how far it is, m, and how much it turns, rad."""
    return np.array([np.hypot(pose[0], pose[1]), abs(float(wrap(pose[2])))])
