"""How a robot moves whose tracks turn about known instantaneous centres of rotation (ICR).

Centres are (y_left, y_right, x) [m] in the robot frame: the points of the plane that move with the
left and the right track and rest on the ground, and how far ahead both of them lie (Martinez,
Mandow et al., "Approximating kinematics for tracked mobile robots", IJRR 2005, eqs. 1 to 3, in our
axes). y_left - y_right is the effective width; without any slip the centres would be the tracks'.
"""

import math

import numpy as np

from grouser.estimators.track_motion import arc_jacobian
from grouser.geometry import Array, exp
from grouser.kernels import kernel


def icr_twist(du: Array, centres: Array) -> Array:
    """(3,) body twist times dt, forward [m], left [m], turn [rad], of track increments (2,) [m].

    Args:
        centres: (3,) y_left > y_right and x, m.
    """
    left, right = du.tolist()
    y_left, y_right, x = centres.tolist()
    turn = (right - left) / (y_left - y_right)
    return np.array([left + turn * y_left, -x * turn, turn])


def icr_twist_jacobians(du: Array, centres: Array) -> tuple[Array, Array]:
    """Derivatives of `icr_twist` by the increments (3, 2) and by the centres (3, 3)."""
    left, right = du.tolist()
    y_left, y_right, x = centres.tolist()
    width = y_left - y_right
    turn = (right - left) / width
    by_du = np.array([[-y_right, y_left], [x, -x], [-1.0, 1.0]]) / width
    by_centres = turn / width * np.array([[-y_right, y_left, 0], [x, -x, -width], [-1, 1, 0]])
    return by_du, by_centres


def exp_jacobian(twist: Array) -> Array:
    """(3, 3) derivative of `geometry.exp` with respect to the twist (3,)."""
    (along_slope, along), (across_slope, across), _ = arc_jacobian(float(twist[2]), 1.0).tolist()
    forward, left, _ = twist.tolist()
    return np.array(
        [
            [along, -across, along_slope * forward - across_slope * left],
            [across, along, across_slope * forward + along_slope * left],
            [0.0, 0.0, 1.0],
        ]
    )


def icr_pose(du: Array, centres: Array) -> Array:
    """(3,) pose after the tracks ran by (2,) [m] about steady centres: the exact arc."""
    return exp(icr_twist(du, centres))


@kernel
def mirrored(du: Array) -> Array:
    """(3, 3) what makes of a left curve's centres those of the course that the tracks run.

    A robot that is built alike left and right, and fore and aft, mirrors its centres when it
    mirrors its course: the middle between them changes sides with the curve (tracks that slide
    sideways have less grip left against the motion resistance, which slows the robot down in every
    turn), and x changes sign when it reverses (shear builds up along a track, so that the centre of
    pressure lies ahead). On the spot neither side is the inner one: both vanish.
    """
    middle, ahead = _courses(du)
    same, other = (1 + middle) / 2, (1 - middle) / 2
    return np.array([[same, -other, 0.0], [-other, same, 0.0], [0.0, 0.0, ahead]])


def mirrored_jacobian(du: Array, centres: Array) -> Array:
    """(3, 2) derivative of `mirrored(du) @ centres` with respect to the increments."""
    both, difference = float(du[0] + du[1]), float(du[1] - du[0])
    by_middle = np.zeros(2)
    if abs(both) < abs(difference):
        by_middle = 2 * np.array([du[1], -du[0]]) / difference**2
    y_left, y_right, x = centres.tolist()
    middle = (y_left + y_right) / 2
    return np.array([middle * by_middle, middle * by_middle, x * _ahead_slope(du)])


@kernel
def on_the_spot(du: Array) -> float:
    """How much of a course is a turn on the spot: 1 there, 0 straight on.

    The effective width grows with it: by a twentieth in our simulation, where the width by
    0.58 m + 0.026 m times this is right to 2 mm from the spot to curves of 3 m.
    """
    return float(1.0 - abs(_courses(du)[1]))


def on_the_spot_slope(du: Array) -> Array:
    """(2,) derivative of `on_the_spot` with respect to the increments."""
    return -math.copysign(1.0, _courses(du)[1]) * _ahead_slope(du)


def _ahead_slope(du: Array) -> Array:
    """(2,) derivative of the second of `_courses` with respect to the increments."""
    both, difference = float(du[0] + du[1]), float(du[1] - du[0])
    reach = math.hypot(both, 2 * difference)
    if reach == 0:
        return np.zeros(2)
    return 4 * difference / reach**3 * np.array([difference + both, difference - both])


@kernel
def _courses(du: Array) -> tuple[float, float]:
    """Which way the middle of the centres lies, and x: -1 to 1 times that of a left curve."""
    both, difference = du[0] + du[1], du[1] - du[0]
    middle = min(max(both / difference, -1.0), 1.0) if difference else 0.0
    reach = math.hypot(both, 2 * difference)
    return middle, both / reach if reach else 0.0
