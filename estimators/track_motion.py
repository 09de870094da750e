"""How a tracked robot moves when its tracks say so: the exact arc, its Jacobians and its noise.

Track increments `du` are (left, right) in metres; the pose increment is that of the midpoint
between the tracks, in the frame before the motion. Small pure functions of plain floats, because a
filter calls them several times a frame.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from grouser.checks import require_not_negative
from grouser.estimators.base import Observation
from grouser.geometry import Array, wrap

# Below this angle [rad] the closed forms' derivatives cancel; the series are exact to 1e-15 there.
_SMALL = 1e-2


@dataclass(frozen=True, slots=True)
class TrackNoise:
    """White noise of one track's increment: sigma = hypot(scale * |du|, floor)."""

    scale: float = 0.03
    """Share of the increment, 1."""
    floor: float = 0.0002
    """Noise at rest (encoder resolution, play of the drive), m."""

    def __post_init__(self) -> None:
        require_not_negative(self, "scale", "floor")

    def covariance(self, du: NDArray[np.float64]) -> Array:
        """(2, 2) of the left and right increment, m^2."""
        left = (self.scale * float(du[0])) ** 2 + self.floor**2
        right = (self.scale * float(du[1])) ** 2 + self.floor**2
        return np.array([[left, 0.0], [0.0, right]])


@dataclass(frozen=True, slots=True)
class SideSlip:
    """Slack of the non-holonomic constraint: a track robot slides sideways a little, most in turns.

    sigma = forward * |chord| + turning * |turn| + floor  (SPEC 1.5, step 1)
    """

    forward: float = 0.02
    """m sideways per m forward."""
    turning: float = 0.005
    """m sideways per rad."""
    floor: float = 1e-5
    """m"""

    def __post_init__(self) -> None:
        require_not_negative(self, "forward", "turning", "floor")

    def sigma(self, turn: float, chord: float) -> float:
        """m, for an increment that turns by `turn` [rad] over `chord` [m]."""
        return self.forward * abs(chord) + self.turning * abs(turn) + self.floor

    def covariance(self, turn: float, chord: float) -> Array:
        """(3, 3) added to the pose increment's: along the left of the half-angle frame."""
        x, y = -math.sin(turn / 2), math.cos(turn / 2)
        variance = self.sigma(turn, chord) ** 2
        return variance * np.array([[x * x, x * y, 0.0], [x * y, y * y, 0.0], [0.0, 0.0, 0.0]])


@dataclass(frozen=True, slots=True)
class GroundSlip:
    """Slip that comes and goes: white noise of an increment that the ground brings."""

    transient: float
    """Share of a change of the tracks' speed: the shear in the ground follows them late."""
    turn: float
    """Share of a turn."""
    side: SideSlip

    def covariance(
        self, turn: float, chord: float, by_turn: Array, by_du: Array, change: Array
    ) -> Array:
        """(3, 3) of an increment that turns by `turn` [rad] over `chord` [m].

        Args:
            by_turn, by_du: (3,) and (3, 2) derivatives of the increment.
            change: (2,) of the tracks' increments since the last one, m.
        """
        late, turned = by_du * (self.transient * change), self.turn * turn * by_turn
        return late @ late.T + np.outer(turned, turned) + self.side.covariance(turn, chord)


def observed_increments(observation: Observation) -> Array:
    """(2,) left and right increment of an observation, m.

    Raises:
        ValueError: they are not two finite numbers.
    """
    du = np.asarray(observation["tracks"], dtype=np.float64)
    if du.shape != (2,) or not np.isfinite(du).all():
        raise ValueError(f"observation 'tracks' must be two finite numbers [m], got {du}")
    return du


def reported_increments(observation: Observation) -> Array | None:
    """(2,) left and right increment of an observation, m; None where a track reports NaN: nothing.

    Raises:
        ValueError: they are not two numbers, or not finite in another way.
    """
    du = np.asarray(observation["tracks"], dtype=np.float64)
    return None if du.shape == (2,) and np.isnan(du).any() else observed_increments(observation)


def track_increment(du: NDArray[np.float64], effective_width: float) -> tuple[float, float]:
    """(turn [rad], arc length [m]) of the midpoint between the tracks: eqs. (4), (5), with W.

    Args:
        du: (2,) left, right increment, m.
        effective_width: m; stands where the paper prints D + 2b.
    """
    left, right = float(du[0]), float(du[1])
    return (right - left) / effective_width, (left + right) / 2


def track_increment_jacobian(effective_width: float) -> Array:
    """(2, 2) derivative of (turn, arc length) with respect to the left and right increment."""
    return np.array([[-1 / effective_width, 1 / effective_width], [0.5, 0.5]])


def chord(turn: float, arc_length: float) -> float:
    """m; the straight line between the ends of an arc: arc_length * sinc(turn / 2)."""
    return arc_length * _sinc(turn / 2)


def arc_pose(turn: float, arc_length: float) -> Array:
    """(3,) pose at the end of an arc of `arc_length` [m] that turns by `turn` [rad]; exact."""
    length = chord(turn, arc_length)
    x, y = length * math.cos(turn / 2), length * math.sin(turn / 2)
    return np.array([x, y, turn if abs(turn) < math.pi else float(wrap(turn))])


def arc_jacobian(turn: float, arc_length: float) -> Array:
    """(3, 2) derivative of `arc_pose` with respect to turn and arc length."""
    # arc_pose is arc_length * (sin t / t, (1 - cos t) / t).
    return np.array(
        [
            [arc_length * _sinc_slope(turn), _sinc(turn)],
            [arc_length * _cosc_slope(turn), _cosc(turn)],
            [1.0, 0.0],
        ]
    )


def increment_jacobian(du: NDArray[np.float64], effective_width: float) -> Array:
    """(3, 2) derivative of the pose increment with respect to the left and right increment.

    The printed input matrix B of eq. (10) is not this: phi depends on the increments too.
    """
    turn, arc_length = track_increment(du, effective_width)
    return arc_jacobian(turn, arc_length) @ track_increment_jacobian(effective_width)


def _sinc(t: float) -> float:
    return math.sin(t) / t if abs(t) > _SMALL else 1 - t**2 / 6 + t**4 / 120


def _cosc(t: float) -> float:
    return 2 * math.sin(t / 2) ** 2 / t if abs(t) > _SMALL else t / 2 - t**3 / 24 + t**5 / 720


def _sinc_slope(t: float) -> float:
    if abs(t) <= _SMALL:
        return -t / 3 + t**3 / 30 - t**5 / 840
    return (t * math.cos(t) - math.sin(t)) / t**2


def _cosc_slope(t: float) -> float:
    if abs(t) <= _SMALL:
        return 0.5 - t**2 / 8 + t**4 / 144
    return (t * math.sin(t) - 2 * math.sin(t / 2) ** 2) / t**2
