"""What the next increment is expected to be: from the tracks, or, without them, as the last one."""

from abc import ABC, abstractmethod
from dataclasses import dataclass, field, replace

import numpy as np

from grouser.checks import require_not_negative, require_positive
from grouser.estimators.base import Observation
from grouser.estimators.track_motion import (
    GroundSlip,
    SideSlip,
    TrackNoise,
    arc_jacobian,
    arc_pose,
    chord,
    reported_increments,
    track_increment,
    track_increment_jacobian,
)
from grouser.estimators.visual.constant_errors import NO_ERRORS, ConstantErrors
from grouser.geometry import Array
from grouser.rig import TrackGeometry


@dataclass(frozen=True, slots=True)
class Increment:
    """A predicted pose increment, in the frame of the pose before it."""

    pose: Array
    """(3,) x, y [m], heading [rad]"""
    covariance: Array
    """(3, 3) of its white noise"""
    by_biases: Array
    """(3, n) derivative by the predictor's constant errors"""
    measured: bool = True
    """Whether it may be fused; a guess says only where to search."""
    of_tracks: Array = field(default_factory=lambda: np.zeros((3, 3)))
    """(3, 3) the part of the covariance that the tracks themselves bring, whatever the ground."""

    def corrected(self, change: Array) -> "Increment":
        """The same, once the constant errors are estimated otherwise by so much, (n,)."""
        return replace(self, pose=self.pose + self.by_biases @ change)


@dataclass(frozen=True, slots=True)
class ScaleOptions:
    """How uncertain the tracks' scales are (SPEC 1.5), and what else is uncertain about a track."""

    track_sigma: float = 0.05
    """Of either track's scale error, which stays the same for long."""
    turn_sigma: float = 0.10
    """Of the effective width's scale error."""
    side_sigma: float = 0.05
    """Of the motion across, m per m along: on a slope, say, the chassis slides to one side."""
    walk: float = 5e-4
    """How far each of them wanders in one frame."""
    track_noise: float = 0.03
    """White noise of a track's increment, as a share of it."""
    transient_noise: float = 0.3
    """The same, as a share of the increment's change since the last one: the shear in the ground
    follows the tracks late."""
    turn_noise: float = 0.05
    """White slip of a turn, as a share of it."""

    def __post_init__(self) -> None:
        require_positive(self, "track_sigma", "turn_sigma", "side_sigma")
        require_not_negative(self, "walk", "track_noise", "transient_noise", "turn_noise")

    def errors(self) -> ConstantErrors:
        """The scale errors of the left track, the right track, the turn and the motion across."""
        return ConstantErrors(
            ("left track's scale", "right track's scale", "turn's scale", "side slip"),
            np.array([self.track_sigma, self.track_sigma, self.turn_sigma, self.side_sigma]),
            np.full(4, self.walk),
        )


class MotionPredictor(ABC):
    """Predicts increments, which are measured, or guessed where nothing measures them."""

    measures: bool
    """Whether there is anything that measures them, be it silent for a while."""
    errors: ConstantErrors
    """Its n constant errors, which the filter estimates."""

    @abstractmethod
    def predict(self, observation: Observation, biases: Array) -> Increment:
        """The increment to this observation, given the constant errors (n,) as estimated."""

    @abstractmethod
    def learn(self, increment: Array | None) -> None:
        """Take note of the increment (3,) as estimated in the end; None where it is unknown."""

    @abstractmethod
    def tell(self, biases: Array, covariance: Array) -> dict[str, float]:
        """Diagnostics of the constant errors (n,) as estimated with a covariance (n, n)."""


class TrackPredictor(MotionPredictor):
    """The tracks measure the increment: SPEC 1.5 step 1 with the exact arc."""

    measures = True

    def __init__(self, tracks: TrackGeometry, options: ScaleOptions) -> None:
        self.errors = options.errors()
        self._tracks = tracks
        self._noise = TrackNoise(options.track_noise)
        self._slip = GroundSlip(options.transient_noise, options.turn_noise, SideSlip())
        self._last: Array | None = None
        self._before: Array | None = None

    def predict(self, observation: Observation, biases: Array) -> Increment:
        measured = reported_increments(observation)
        before, self._before = self._before, None
        if measured is None:
            return self._guess(np.zeros((3, len(biases))))
        self._before = measured.copy()
        width = self._tracks.effective_width
        du = measured * (1 + biases[:2])
        turn, arc_length = track_increment(du, width)
        straight = arc_pose(turn * (1 + biases[2]), arc_length)
        # Slip across is a share of the chord, at right angles to it.
        across = np.array([[1.0, -biases[3], 0.0], [biases[3], 1.0, 0.0], [0.0, 0.0, 1.0]])
        by_arc = across @ arc_jacobian(turn * (1 + biases[2]), arc_length)
        by_turn = by_arc[:, 0]
        by_du = by_arc @ (np.diag([1 + biases[2], 1.0]) @ track_increment_jacobian(width))
        of_tracks = by_du @ self._noise.covariance(du) @ by_du.T
        change = np.zeros(2) if before is None else measured - before
        slip = self._slip.covariance(turn, chord(turn, arc_length), by_turn, by_du, change)
        by_side = np.array([-straight[1], straight[0], 0.0])
        by_biases = np.column_stack([by_du * measured, by_turn * turn, by_side])
        return Increment(across @ straight, of_tracks + slip, by_biases, of_tracks=of_tracks)

    def _guess(self, by_biases: Array) -> Increment:
        if self._last is None:
            return Increment(np.zeros(3), np.diag(_UNKNOWN**2), by_biases, measured=False)
        return _again(self._last, by_biases)

    def learn(self, increment: Array | None) -> None:
        """The tracks need it where they report nothing."""
        self._last = None if increment is None else increment.copy()

    def tell(self, biases: Array, covariance: Array) -> dict[str, float]:
        width = self._tracks.effective_width / (1 + float(biases[2]))
        sigma = width / (1 + float(biases[2])) * float(np.sqrt(covariance[2, 2]))
        return {"effective_width": width, "effective_width_sigma": sigma}


class VelocityPredictor(MotionPredictor):
    """Without tracks the last turn and chord are expected again: where to search, no measurement.

    What the chassis does not do, to move across, is not expected because it was seen once.
    """

    measures = False
    errors = NO_ERRORS

    def __init__(self, first_sigma: Array) -> None:
        """first_sigma: (3,) of the increment while nothing is known of the velocity."""
        self._first = first_sigma
        self._last: Array | None = None

    def predict(self, observation: Observation, biases: Array) -> Increment:
        zero = np.zeros((3, 0))
        if self._last is None:
            return Increment(np.zeros(3), np.diag(self._first**2), zero, measured=False)
        return _again(self._last, zero)

    def learn(self, increment: Array | None) -> None:
        self._last = None if increment is None else increment.copy()

    def tell(self, biases: Array, covariance: Array) -> dict[str, float]:
        return {}


def _again(last: Array, by_biases: Array) -> Increment:
    """The guess that the last increment (3,) comes again, but for what it had across."""
    turn = float(last[2])
    along = np.array([np.cos(turn / 2), np.sin(turn / 2), 0.0])
    across = np.array([-along[1], along[0], 0.0])
    length = float(along @ last)
    covariance = (0.02 + 0.1 * abs(length)) ** 2 * np.outer(along, along)
    covariance += (0.0005 + 0.04 * abs(length)) ** 2 * np.outer(across, across)
    covariance[2, 2] = np.radians(1.5) ** 2
    return Increment(np.append(length * along[:2], turn), covariance, by_biases, measured=False)


_UNKNOWN = np.array([0.5, 0.1, 0.2])  # m, m, rad a frame: one sigma of a motion that nobody knows
