"""The calibration of a vehicle on the plane: paper 2's (SPEC 2.0) unless otherwise said."""

import math
from collections.abc import Mapping
from numbers import Real
from types import MappingProxyType
from typing import Any

import numpy as np

from grouser.checks import did_you_mean
from grouser.rig import Lidar, Rig, TrackGeometry
from grouser.rig_motion import LineSensor, Steering

NOISES: Mapping[str, float] = MappingProxyType(
    {
        "speed": 0.3,  # of the reported speed, m/s
        "angle": math.radians(3.0),  # of the reported steering angle, rad
        "tracks": 0.01,  # of a reported track increment, over the increment
        "range": 0.1,  # of a seen end, m
        "bearing": math.radians(1.0),  # of a seen end, rad
        "scan_range": 0.03,  # of a beam, m
        "scan_bearing": math.radians(0.1),  # of a beam, rad
    }
)
"""Standard deviations of all noises: those that paper 2 has are the paper's."""

MOTIONS = ("steering", "tracks")
"""What a vehicle may move by."""

_WHEELBASE, _MAX_ANGLE, _MAX_RATE = 4.0, math.radians(30.0), math.radians(20.0)
_GAUGE, _TRACK_WIDTH = 2.0, 0.4


def plane_rig(
    motion: str,
    *,
    dt: float,
    speed: float,
    range_max: float,
    n_beams: int,
    max_lines: int,
    noise: Mapping[str, float],
) -> Rig:
    """A rig with the part that moves the vehicle, a line sensor and a lidar, both at its origin.

    Raises:
        ValueError: an unknown motion, or a value out of range.
    """
    if motion not in MOTIONS:
        raise ValueError(
            f"no motion is named {motion!r}; {did_you_mean(motion, MOTIONS)}known: "
            f"{', '.join(MOTIONS)}"
        )
    if not (isinstance(n_beams, int) and n_beams > 0):
        raise ValueError(f"n_beams must be a whole number above zero, got {n_beams!r}")
    steering = Steering(_WHEELBASE, speed, _MAX_ANGLE, _MAX_RATE, noise["speed"], noise["angle"])
    tracks = TrackGeometry(gauge=_GAUGE, width=_TRACK_WIDTH, effective_width=_GAUGE)
    return Rig(
        dt=dt,
        tracks=tracks if motion == "tracks" else None,
        steering=steering if motion == "steering" else None,
        line_sensor=LineSensor(range_max, noise["range"], noise["bearing"], max_lines),
        lidar=_lidar(n_beams, range_max, noise),
    )


def noises(given: float | Mapping[str, float]) -> dict[str, float]:
    """All of NOISES: times a number, or with some of them replaced.

    Raises:
        ValueError: a name that none has, or a number that is negative or not finite.
    """
    if isinstance(given, Mapping):
        unknown = [name for name in given if name not in NOISES]
        if unknown:
            raise ValueError(
                f"no noise is named {unknown[0]!r}; {did_you_mean(unknown[0], NOISES)}known: "
                f"{', '.join(NOISES)}"
            )
        amounts: dict[str, Any] = {**NOISES, **given}
    else:
        factor = given if isinstance(given, Real) else math.nan
        amounts = {name: factor * sigma for name, sigma in NOISES.items()}
    if not all(isinstance(a, Real) and 0 <= float(a) < math.inf for a in amounts.values()):
        raise ValueError(
            "noise must be a number of zero or more that multiplies all of them, or such numbers "
            f"by name, {', '.join(NOISES)}; got {given!r}"
        )
    return {name: float(amount) for name, amount in amounts.items()}


def _lidar(n_beams: int, range_max: float, noise: Mapping[str, float]) -> Lidar:
    """All around, the first beam backwards."""
    return Lidar(
        n_beams=n_beams,
        angle_min=-math.pi,
        angle_increment=2 * math.pi / n_beams,
        range_min=0.0,
        range_max=range_max,
        sigma_range=noise["scan_range"],
        sigma_bearing=noise["scan_bearing"],
        T_base_lidar=np.eye(4),
    )
