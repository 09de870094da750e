"""Everything that may be wrong with sensors and tracks: one flat vocabulary of dotted names.

An effect has an amount at every time. `Effect.default` holds where nothing else is said; what a
`Schedule` is given holds all the time, and a fault of it for a while.
"""

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from math import isfinite
from numbers import Real
from types import MappingProxyType

from grouser.checks import did_you_mean

SHARE = "share"
SWITCH = "0 or 1"


@dataclass(frozen=True, slots=True)
class Effect:
    """One thing that may be wrong, and how much of it there may be."""

    default: float
    unit: str
    meaning: str
    most: float
    least: float = 0.0
    follows: str | None = None
    """The effect whose amount holds for this one where none is given."""


_OF_EITHER_EYE = {
    "read_noise": Effect(1.5, "grey levels", "noise of the same size everywhere", 64.0),
    "shot_noise": Effect(0.0, "grey levels", "variance of the photon noise over the level", 16.0),
    "exposure_drift": Effect(
        0.0, SHARE, "standard deviation of the exposure, which wanders within some 10 s", 1.0
    ),
    "motion_blur": Effect(0.0, "s", "time for which the shutter is open", 0.1),
    "vignetting": Effect(0.0, SHARE, "light lost in the corners of the image", 1.0),
    "defocus": Effect(0.0, "px", "standard deviation of a Gaussian blur", 16.0),
    "rolling_shutter": Effect(0.0, "s", "from reading the first row to reading the last one", 0.1),
    "distortion": Effect(
        0.0, "k1", "radial distortion of the lens, taken out again: sharpness and borders go", 0.5,
        -0.5,
    ),
    "rectification_error": Effect(
        0.0, "k1", "radial distortion that is left in the rectified image", 0.5, -0.5
    ),
    "dropped": Effect(0.0, "probability", "a frame is black", 1.0),
    "frozen": Effect(0.0, "probability", "a frame is the one before it once more", 1.0),
    "darkness": Effect(0.0, SHARE, "light that is missing; the noise stays", 1.0),
    "glare": Effect(0.0, SHARE, "veil that the sun lays over an image that looks at it", 1.0),
}  # fmt: skip

_OF_THE_PAIR = {
    "gain_mismatch": Effect(0.0, SHARE, "how much brighter the right eye is", 1.0, -0.9),
    "miscalibration": Effect(
        0.0, "rad", "the right eye looks up by this from where the rig says", 0.2, -0.2
    ),
    "miscalibration_yaw": Effect(
        0.0, "rad", "the right eye looks to the left by this from where the rig says", 0.2, -0.2
    ),
    "disparity_offset": Effect(
        0.0, "px", "by this all disparities are larger than the rig says", 8.0, -8.0
    ),
    "desynchronisation": Effect(0.0, "s", "how much older the right image is", 0.1),
}

_LIDAR = {
    "range_noise": Effect(0.01, "m", "standard deviation of a range", 10.0),
    "bearing_noise": Effect(1e-3, "rad", "standard deviation of a beam's bearing", 0.5),
    "quantisation": Effect(0.0, "m", "step in which ranges are told", 1.0),
    "dropout": Effect(0.0, "probability", "a beam returns nothing", 1.0),
    "mixed_pixels": Effect(
        0.0, "rad", "half width of a beam: what meets two things reads something between", 0.05
    ),
    "range_loss": Effect(0.0, SHARE, "of the longest range: nothing beyond returns", 1.0),
    "glass": Effect(0.0, SHARE, "of the solids that beams pass through", 1.0),
    "motion_skew": Effect(0.0, "s", "a scan takes this time, while the robot moves", 0.1),
}

_TRACKS = {
    "noise": Effect(0.01, SHARE, "standard deviation of an increment, over the increment", 1.0),
    "resolution": Effect(1e-4, "m", "track between two ticks of an encoder", 0.1, 1e-6),
    "missed_ticks": Effect(0.0, "probability", "a tick is not counted", 1.0),
    "left_scale": Effect(0.0, SHARE, "what the left encoder reads too much", 0.5, -0.5),
    "right_scale": Effect(0.0, SHARE, "what the right encoder reads too much", 0.5, -0.5),
    "left_stuck": Effect(0.0, SWITCH, "the left encoder reads no motion", 1.0),
    "right_stuck": Effect(0.0, SWITCH, "the right encoder reads no motion", 1.0),
}

_IMU = {
    "acceleration_noise": Effect(0.05, "m/s^2", "standard deviation of a reading", 100.0),
    "rate_noise": Effect(2e-3, "rad/s", "standard deviation of a reading", 10.0),
    "acceleration_walk": Effect(
        0.0, "m/s^2 / sqrt(s)", "random walk of each axis's bias: its deviation after 1 s", 10.0
    ),
    "rate_walk": Effect(
        0.0, "rad/s / sqrt(s)", "random walk of each axis's bias: its deviation after 1 s", 1.0
    ),
    "acceleration_bias": Effect(0.0, "m/s^2", "added to every axis", 20.0, -20.0),
    "rate_bias": Effect(0.0, "rad/s", "added to every axis", 10.0, -10.0),
    "dead": Effect(0.0, SWITCH, "it reads zeros", 1.0),
}

_GPS = {
    "noise": Effect(0.5, "m", "standard deviation of either coordinate", 100.0),
    "drift": Effect(
        0.0, "m", "standard deviation of an error that wanders within some 60 s", 100.0
    ),
    "jump": Effect(0.0, "m", "by this the fix is off, in one direction an episode", 1000.0),
    "outage": Effect(0.0, SWITCH, "there is no fix: NaN", 1.0),
}

_ONE_TRACK = {
    "power_loss": Effect(0.0, SHARE, "of the commanded speed that the motor does not reach", 1.0),
    "traction_loss": Effect(0.0, SHARE, "of the belt's driving force that does not arrive", 1.0),
}


def _vocabulary() -> dict[str, Effect]:
    groups = {
        "stereo": _OF_EITHER_EYE | _OF_THE_PAIR,
        "left": {name: _following(name, effect) for name, effect in _OF_EITHER_EYE.items()},
        "right": {name: _following(name, effect) for name, effect in _OF_EITHER_EYE.items()},
        "lidar": _LIDAR,
        "tracks": _TRACKS,
        "imu": _IMU,
        "gps": _GPS,
        "left_track": _ONE_TRACK,
        "right_track": _ONE_TRACK,
    }
    return {f"{group}.{name}": e for group, inner in groups.items() for name, e in inner.items()}


def _following(name: str, both: Effect) -> Effect:
    return Effect(
        both.default, both.unit, both.meaning, both.most, both.least, follows=f"stereo.{name}"
    )


EFFECTS: Mapping[str, Effect] = MappingProxyType(_vocabulary())
"""Every effect by name. left.* and right.* are of one eye and follow stereo.*, which is of both."""

NOISES = (
    *(f"{eye}.{kind}" for eye in ("left", "right") for kind in ("read_noise", "shot_noise")),
    "lidar.range_noise",
    "lidar.bearing_noise",
    "tracks.noise",
    "imu.acceleration_noise",
    "imu.rate_noise",
    "gps.noise",
)
"""The white noises, which domain randomisation multiplies; the rig goes on saying what it says."""


def effects_table() -> str:
    """All effects as a table in Markdown, one a line; left.* and right.* are said once."""
    lines = ["| effect | default | from | to | unit | meaning |", "|---|---|---|---|---|---|"]
    for name, effect in EFFECTS.items():
        if effect.follows is None:
            also = " (left, right)" if f"left.{name.partition('.')[2]}" in followers(name) else ""
            lines.append(
                f"| `{name}`{also} | {effect.default:g} | {effect.least:g} | {effect.most:g} "
                f"| {effect.unit} | {effect.meaning} |"
            )
    return "\n".join(lines)


def followers(name: str) -> list[str]:
    """The effects that take this one's amount where they have none of their own."""
    return [other for other, effect in EFFECTS.items() if effect.follows == name]


def checked_amount(name: str, amount: object) -> float:
    """An effect's amount as a number.

    Raises:
        ValueError: no effect has that name (the message suggests near ones), or the amount is
            none that it may have.
    """
    effect = EFFECTS[known(name, EFFECTS, "effect")]
    number = isinstance(amount, Real) and isfinite(amount)
    if not (number and effect.least <= float(amount) <= effect.most):  # type: ignore[arg-type]
        raise ValueError(
            f"{name} is {effect.meaning!r} and must be a number from {effect.least:g} to "
            f"{effect.most:g} ({effect.unit}), got {amount!r}"
        )
    if effect.unit == SWITCH and amount not in (0, 1):
        raise ValueError(f"{name} is {effect.meaning!r} and must be 0 or 1, got {amount!r}")
    return float(amount)  # type: ignore[arg-type]


def known(name: object, names: Collection[str], kind: str) -> str:
    """The name, which is one of these dotted names.

    Raises:
        ValueError: it is not; the message suggests near ones and lists those of its group.
    """
    if isinstance(name, str) and name in names:
        return name
    hint = did_you_mean(name, names)
    group = str(name).partition(".")[0]
    own = [other for other in names if other.partition(".")[0] == group]
    if own:
        raise ValueError(f"no {kind} is named {name!r}; {hint}{group} has: {', '.join(own)}")
    groups = dict.fromkeys(other.partition(".")[0] for other in names)
    listed = ", ".join(f"{each}.*" for each in groups)
    raise ValueError(f"no {kind} is named {name!r}; {hint}known: {listed}")
