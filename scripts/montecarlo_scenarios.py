"""The drives of SPEC 1.7: 12 mm a frame, as the paper's robot at 0.35 m/s and 30 frames/s."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from math import radians

import numpy as np

from grouser.geometry import Array
from grouser.rig import StereoCamera, camera_mount
from grouser.scripts.montecarlo_world import Motion

STEP = 0.012  # m a frame
TURN = radians(1.0)  # a frame, on the spot
HEIGHT = 0.4  # m


@dataclass(frozen=True, slots=True)
class Scenario:
    """A drive, and the camera it is seen with."""

    words: str
    motion: Callable[[], Motion]
    offset: bool = False
    """The camera is off the track centre and looks down: a = .15 m, b = .05 m, 10 degrees."""

    @property
    def camera(self) -> StereoCamera:
        """The left eye: 320 x 240 px, f 260 px, baseline 0.12 m."""
        mount = camera_mount(0.0, 0.0, HEIGHT)
        if self.offset:
            mount = camera_mount(0.15, 0.05, HEIGHT, pitch=radians(10))
        return StereoCamera(
            fx=260.0,
            fy=260.0,
            cx=159.5,
            cy=119.5,
            baseline=0.12,
            width=320,
            height=240,
            T_base_camera=mount,
        )


def linear() -> Motion:
    """200 frames out and 200 back, straight."""
    return _free_of_slip(np.zeros(400), np.repeat([STEP, -STEP], 200))


def spot() -> Motion:
    """Once around, on the spot."""
    return _free_of_slip(np.full(360, TURN), np.zeros(360))


def free() -> Motion:
    """7 m of bends to either side."""
    k = np.arange(round(7.0 / STEP))
    return _free_of_slip(
        np.radians(0.25 + 0.8 * np.sin(2 * np.pi * k / 190)), np.full(len(k), STEP)
    )


def slipping() -> Motion:
    """Linear; the tracks run a tenth faster than the ground goes by."""
    motion = linear()
    return replace(motion, reported_chord=motion.chord / (1 - 0.10))


def yaw_slipping() -> Motion:
    """On the spot; 15 % of the turn is lost."""
    motion = spot()
    return replace(motion, reported_turn=motion.turn / (1 - 0.15))


def sideslipping() -> Motion:
    """Linear; the robot moves to its left by 5 % of what it moves ahead."""
    motion = linear()
    return replace(motion, side=0.05 * motion.chord)


def blackout() -> Motion:
    """Linear; 60 frames on the way out show nothing."""
    motion = linear()
    dark = np.zeros(len(motion.turn), dtype=bool)
    dark[100:160] = True
    return replace(motion, dark=dark)


SCENARIOS = {
    "linear": Scenario("400 frames, out and back", linear),
    "linear-offset": Scenario("the same, camera offset", linear, offset=True),
    "slip": Scenario("linear, 10 % track slip", slipping),
    "sideslip": Scenario("linear, 5 % sideways slip", sideslipping),
    "blackout": Scenario("linear, 60 frames dark", blackout),
    "spot": Scenario("360 degrees on the spot", spot),
    "spot-offset": Scenario("the same, camera offset", spot, offset=True),
    "spot-slip": Scenario("offset, 15 % yaw slip", yaw_slipping, offset=True),
    "free": Scenario("7 m of bends, camera offset", free, offset=True),
}


def _free_of_slip(turn: Array, chord: Array) -> Motion:
    n = len(turn)
    return Motion(turn, chord, np.zeros(n), turn, chord, np.zeros(n, dtype=bool))
