"""What a slope and uneven ground do to a robot on tracks, beside what level ground does.

Tracks that turn slide across, and what slides resists a further load only by as much as it changes
the direction in which it slides: the robot creeps downhill with every turn. Straight on, tracks
shear the ground, and slip by the load over the shear's stiffness: a share of the way, and a small
one. And where the ground bends, the load wanders between the shoes and the centres of rotation with
it, for about as far as the robot is long.
"""

from dataclasses import dataclass, fields, replace

import numpy as np

from grouser.checks import require_not_negative
from grouser.estimators.inclination import levelling
from grouser.estimators.visual.prediction import Increment
from grouser.geometry import Array


@dataclass(frozen=True, slots=True)
class SlopeOptions:
    """How far tracks creep and slip on a slope.

    Lengths are shares of the effective width, which stands for how far out the tracks slide. Slip
    is white noise as large as what lasts for about a metre comes to over a longer way.
    """

    creep_turning: float = 0.85
    """Downhill, over the sine of the slope: widths per rad of a turn. The more, the less friction:
    in our simulation 0.7 on asphalt, 0.9 on grass, 1.3 in mud and 3 on ice."""
    creep_turning_sigma: float = 0.3
    """How far that may be off."""
    creep_turning_walk: float = 3e-3
    """How far it wanders in one frame: the ground changes."""
    creep_along: float = 0.04
    """Downhill, over the sine of the slope: share of the way."""
    creep_along_sigma: float = 0.08
    """How far that may be off: soft ground shears more."""
    creep_along_walk: float = 5e-4
    """How far it wanders in one frame."""
    turn_slip: float = 1.0
    """White, over the sine of the slope: rad per square root of a rad turned."""
    slide: float = 0.6
    """White, in any direction, over the sine of the slope: widths per square root of a rad."""
    turn_bump: float = 2.5
    """White: rad of heading per rad that the robot tilts in a step."""
    slide_bump: float = 1.2
    """White, in any direction: widths per rad that the robot tilts in a step."""
    unknown: float = 0.02
    """Root mean square of the sine of slopes that nothing tells: even a paved yard falls by a
    fiftieth, for the rain."""
    unknown_for: float = 2.0
    """rad, of turns in which such a slope does not change its direction."""

    def __post_init__(self) -> None:
        require_not_negative(self, *(field.name for field in fields(self)))


def on_slope(level: Increment, vertical: Array, creep: Array) -> Increment:
    """What becomes of an increment on level ground where the ground is tilted.

    Args:
        level: the increment, with n constant errors.
        vertical: (3,) up as the robot sees it.
        creep: (2,) downhill over the sine of the slope, in m per rad and as a share of the way; two
            more constant errors of the increment that is returned.
    """
    way, turn = float(level.pose[0]), float(level.pose[2])
    uphill, onto_level = vertical[:2], levelling(vertical)[:2, :2]
    pose = level.pose.copy()
    pose[:2] = onto_level @ pose[:2] - uphill * (creep[0] * abs(turn) + creep[1] * abs(way))
    by_level = np.eye(3)
    by_level[:2, :2] = onto_level
    by_level[:2, 0] -= uphill * creep[1] * np.sign(way)
    by_level[:2, 2] -= uphill * creep[0] * np.sign(turn)
    by_creep = np.zeros((3, 2))
    by_creep[:2] = -np.outer(uphill, [abs(turn), abs(way)])
    return Increment(
        pose,
        by_level @ level.covariance @ by_level.T,
        np.column_stack([by_level @ level.by_biases, by_creep]),
        level.measured,
    )


def slip_covariance(
    turn: float, sine_squared: float, tilted: float, width: float, options: SlopeOptions
) -> Array:
    """(3, 3) of the slip on a slope that is known.

    Args:
        turn: rad
        sine_squared: of the slope.
        tilted: by how much the robot tilted meanwhile, rad.
        width: the effective one, m.
    """
    turned, bumped = abs(turn) * sine_squared, tilted * tilted
    slide = width**2 * (options.slide**2 * turned + options.slide_bump**2 * bumped)
    heading = options.turn_slip**2 * turned + options.turn_bump**2 * bumped
    return np.diag([slide, slide, heading])


def unknown_covariance(turn: float, width: float, options: SlopeOptions) -> Array:
    """(3, 3) of the slip and the creep on a slope that nothing tells; `turn` [rad], `width` [m]."""
    return steep_covariance(turn, options.unknown**2, width, options)


def on_steep(
    increment: Increment, vertical: Array, width: float, options: SlopeOptions
) -> Increment:
    """An increment less sure by what it slips and creeps on a slope that is roughly known.

    Args:
        vertical: (3,) up as the robot sees it, by a pose in space that drifts.
        width: the effective one, m.
    """
    steepness = float(vertical[:2] @ vertical[:2])
    slip = steep_covariance(float(increment.pose[2]), steepness, width, options)
    return replace(increment, covariance=increment.covariance + slip)


def steep_covariance(
    turn: float, sine_squared: float, width: float, options: SlopeOptions
) -> Array:
    """(3, 3) of the slip and the creep on a slope of which only the steepness is known.

    Args:
        turn: rad
        sine_squared: of the slope.
        width: the effective one, m.
    """
    covariance = slip_covariance(turn, sine_squared, 0.0, width, options)
    crept = (width * options.creep_turning) ** 2 * sine_squared
    covariance[:2, :2] += np.eye(2) * crept * options.unknown_for * abs(turn)
    return covariance
