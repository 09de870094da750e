"""One drive for both dynamics, over speeds and turns, and the slip in it."""

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from grouser.envs.simulation.materials import MATERIALS, Material
from grouser.envs.simulation.motion import Motion, longitudinal_slip
from grouser.envs.simulation.robot import RobotModel, TrackedRobot
from grouser.geometry import Array
from grouser.scripts.plain_world import plain_world

DT: Final = 0.1
"""Length of a control step, s."""
SPEEDS: Final = (0.15, 0.3, 0.5)
"""Of the faster track, m/s."""
TURNS: Final = (1.0, 0.7, 0.3, 0.0, -0.5, -1.0)
"""Speed of the slower track over that of the faster one: from straight on to a turn on the spot."""
SLOPE: Final = 0.08
"""rad, of the rise on which the drives are made once more; ice holds no robot on more than 0.12."""

MEASURES: Final[Mapping[str, str]] = {
    "slip": "slip ratio of a track",
    "side": "side speed, m/s",
    "yaw": "yaw rate over what the tracks say",
}
"""What is compared, in words."""

_HELD = 12
"""Steps for which a command lasts: long enough to be steady, short enough to show transients."""
_TURNING = 0.05
"""m/s between the tracks: below, a yaw rate says little of them."""


@dataclass(frozen=True, slots=True)
class Setting:
    """Where a drive is made."""

    terrain: str
    slope: float
    """rad"""


def settings(terrains: Sequence[str]) -> list[Setting]:
    """Each terrain, level and on a slope."""
    return [Setting(terrain, slope) for terrain in terrains for slope in (0.0, SLOPE)]


def commands() -> Array:
    """(n, 2) track speeds, m/s: all pairs of SPEEDS and TURNS, to both sides, forwards and
    backwards, in an order that mixes them, so that every change is among them."""
    faster = np.array(list(itertools.product(SPEEDS, TURNS)))
    pairs = np.column_stack([faster[:, 0], faster[:, 0] * faster[:, 1]])
    pairs = np.concatenate([pairs, pairs[:, ::-1]])
    every = np.concatenate([pairs, -pairs])
    mixed = np.random.default_rng(0).permutation(every)
    return np.repeat(mixed, _HELD, axis=0)


def drive(
    setting: Setting,
    speeds: Array,
    *,
    dynamics: str,
    materials: Sequence[Material] = MATERIALS,
) -> list[Motion]:
    """The motions of every step of a drive with these track speeds (n, 2)."""
    robot = TrackedRobot(RobotModel(), dt=DT, dynamics=dynamics, materials=materials)
    try:
        robot.enter(plain_world(setting.terrain, slope=setting.slope))
        return [robot.step(speed) for speed in speeds]
    finally:
        robot.close()


def twists(motions: Sequence[Motion]) -> Array:
    """(n, 3) forward [m/s], left [m/s], yaw rate [rad/s]."""
    return np.array([motion.twist for motion in motions])


def slips(motions: Sequence[Motion]) -> dict[str, Array]:
    """Samples of each of MEASURES in a drive."""
    gauge = RobotModel().tracks.gauge
    left, right = np.array([motion.track_speed for motion in motions]).T
    twist, apart = twists(motions), np.abs(right - left)
    turning = apart > _TURNING
    said = np.where(turning, right - left, 1.0) / gauge
    return {
        "slip": np.array([longitudinal_slip(motion, gauge) for motion in motions]).ravel(),
        "side": twist[:, 1],
        "yaw": (twist[:, 2] / said)[turning],
    }
