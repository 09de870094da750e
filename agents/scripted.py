"""Scripted drives: the action of each step as a function of the step, whatever happens.

A robot that does as it is told stays within 3.1 m of the start in all of them. A real one slips and
wanders off; turns are by the effective width, which stands for the usual slip.
"""

import math
from collections.abc import Callable

import numpy as np

from grouser.geometry import Array
from grouser.rig import Rig

Drive = Callable[[int], Array]
"""Step to action (2,): left, right track speed as a fraction of the top speed."""

TOP_SPEED = 0.5
"""m/s at an action of one."""

_REACH = 3.0
"""m"""
_LOOP_RADIUS = 0.8
"""m"""


def straight(rig: Rig, *, speed: float = 0.35, top_speed: float = TOP_SPEED) -> Drive:
    """Three metres out, and back in reverse, over and over; speed in m/s."""
    leg = round(_REACH / (speed * rig.dt))
    forward = track_action(rig, speed, 0.0, top_speed=top_speed)
    return lambda step: forward if (step // leg) % 2 == 0 else -forward


def spot_turn(rig: Rig, *, turn_rate: float = 0.5, top_speed: float = TOP_SPEED) -> Drive:
    """Turn in place: once around to the left, once to the right, and so on; rate in rad/s."""
    around = round(2 * math.pi / (turn_rate * rig.dt))
    left = track_action(rig, 0.0, turn_rate, top_speed=top_speed)
    return lambda step: left if (step // around) % 2 == 0 else -left


def figure_eight(rig: Rig, *, speed: float = 0.36, top_speed: float = TOP_SPEED) -> Drive:
    """A circle to the left, one to the right, and so on, from their common point; speed in m/s."""
    turn_rate = speed / _LOOP_RADIUS
    around = round(2 * math.pi / (turn_rate * rig.dt))
    left = track_action(rig, speed, turn_rate, top_speed=top_speed)
    return lambda step: left if (step // around) % 2 == 0 else left[::-1].copy()


DRIVES: dict[str, Callable[[Rig], Drive]] = {
    "straight": straight,
    "spot-turn": spot_turn,
    "figure-eight": figure_eight,
}


def track_action(rig: Rig, speed: float, turn_rate: float, *, top_speed: float) -> Array:
    """The action (2,) for a forward speed [m/s] and a turn rate [rad/s, left positive].

    Where a track would have to exceed its top speed, both are slowed down alike, so that the curve
    stays the same.

    Raises:
        ValueError: the rig has no tracks.
    """
    if rig.tracks is None:
        raise ValueError("to drive, a robot needs tracks; this rig has none (rig.tracks is None)")
    difference = turn_rate * rig.tracks.effective_width / 2
    speeds = np.array([speed - difference, speed + difference]) / top_speed
    return speeds / max(1.0, float(np.abs(speeds).max()))
