"""Where one surface ends and another begins: SPEC 2.5, step 1.

The distance between two neighbouring returns that one surface explains grows with the range and
with how flatly the beams meet it (Borges and Aldon, "Line extraction in 2D range images for mobile
robotics", J. Intelligent and Robotic Systems 40, 2004).
"""

import math

import numpy as np
from numpy.typing import NDArray

from grouser.estimators.line_slam.returns import Returns, Spacing
from grouser.geometry import Array
from grouser.kernels import kernel


@kernel
def joined(returns: Returns, i: int, j: int, spacing: Spacing) -> bool:
    """Whether one surface explains return i and return j, which comes after it on the way around.

    It is met no flatter than `spacing.flattest`, and few beams between them are missing.
    """
    steps = returns.beams[j] - returns.beams[i]
    turn = steps * spacing.step
    if steps <= 0:
        if spacing.seam == 0:
            return False
        steps += spacing.n_beams
        turn = (steps - 1) * spacing.step + spacing.seam
    if steps - 1 > spacing.missing:
        return False
    nearer = min(returns.ranges[i], returns.ranges[j])
    flattest = max(spacing.flattest, 2 * turn)
    reach = nearer * math.sin(turn) / math.sin(flattest - turn)
    reach += 3 * (spacing.sigma_range + spacing.sigma_bearing * nearer)
    return bool(_distance(returns.points, i, j) <= reach)


@kernel
def break_points(returns: Returns, spacing: Spacing) -> NDArray[np.bool_]:
    """(m,) whether the surface breaks between each return and the next one, the first after the
    last."""
    m = len(returns.beams)
    breaks = np.ones(m, dtype=np.bool_)
    for i in range(m if m > 1 else 0):
        breaks[i] = not joined(returns, i, (i + 1) % m, spacing)
    return breaks


@kernel
def beginning(returns: Returns, breaks: NDArray[np.bool_], spacing: Spacing) -> int:
    """The return to begin with, so that no surface is cut that need not be.

    Where the scan is a full turn that is the one after the widest break, whatever beam the scan
    began with; where nothing breaks, the farthest one, most likely a corner.
    """
    m = len(breaks)
    if spacing.seam == 0 or m == 0:
        return 0
    widest, begin = -1.0, int(np.argmax(returns.ranges))
    for i in range(m):
        j = (i + 1) % m
        if breaks[i] and _distance(returns.points, i, j) > widest:
            widest, begin = _distance(returns.points, i, j), j
    return begin


@kernel
def _distance(points: Array, i: int, j: int) -> float:
    return math.hypot(points[j, 0] - points[i, 0], points[j, 1] - points[i, 1])
