"""What a chassis is likely to do between two frames: planar and non-holonomic, with a sigma.

The paper takes both for laws. A real chassis rolls and pitches by tenths of a degree a frame and
slips sideways, which at 20 m range is pixels; so they are priors here, stated in one place.

The constraint holds at every moment, not between the ends of a path: who turns left, then right,
ends up beside the chord of an arc. Over several frames the prior of `side` is therefore about what
the prediction says.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from grouser.estimators.visual.planar import ChassisTolerance
from grouser.geometry import Array


@dataclass(frozen=True, slots=True)
class MotionPrior:
    """What is believed of a motion (see `visual.motion`) before the images are compared."""

    mean: Array
    """(6,)"""
    sigma: Array
    """(6,); vague for turn and chord, which vision alone shall tell"""

    def widened(self, sigma: Array) -> "MotionPrior":
        """The same, less sure by sigmas (6,)."""
        return MotionPrior(self.mean, np.hypot(self.sigma, sigma))

    @property
    def side(self) -> float:
        """Expected displacement across the half-angle frame, m."""
        return float(self.mean[2])

    def in_space(self) -> "MotionPrior":
        """As it is."""
        return self

    def on_the_plane(self) -> "MotionPrior":
        """The same, sure that there is no height, roll and pitch."""
        flat = np.array([1.0, 1.0, 1.0, 0.0, 0.0, 0.0])
        sigma = np.where(flat > 0, self.sigma, _FLAT)
        return MotionPrior(self.mean * flat, sigma)

    def on_an_arc(self) -> "MotionPrior":
        """The same, sure that there is no side either: the paper's law."""
        flat = self.on_the_plane()
        only = np.array([1.0, 1.0, 0.0, 0.0, 0.0, 0.0])
        return MotionPrior(flat.mean * only, np.where(only > 0, flat.sigma, _FLAT))

    @property
    def tolerance(self) -> ChassisTolerance:
        """What one-point hypotheses must tolerate."""
        return ChassisTolerance(
            height=float(self.sigma[3]), roll=float(self.sigma[4]), pitch=float(self.sigma[5])
        )


Constraint = Callable[[MotionPrior], MotionPrior]
REFINEMENTS: dict[str, Constraint] = {
    "spatial": MotionPrior.in_space,
    "planar": MotionPrior.on_the_plane,
    "arc": MotionPrior.on_an_arc,
}
"""What a refinement takes for law, by name."""


@dataclass(frozen=True, slots=True)
class ChassisPrior:
    """One sigma of what a planar, non-holonomic motion would not have, over one increment."""

    side_per_chord: float = 0.02
    """m across per m along"""
    side_per_turn: float = 0.01
    """m across per rad: the centre about which the robot truly turns wanders"""
    side_floor: float = 2e-4
    """m"""
    height_per_chord: float = 0.02
    """m up per m along"""
    height_floor: float = 0.001
    """m"""
    tilt_floor: float = 0.003
    """rad of roll and of pitch, at rest already: suspension and joints of the ground"""
    tilt_per_chord: float = 0.005
    """rad per m along"""

    def about(self, motion: Array, side_sigma: float, mount_sigma: Array) -> MotionPrior:
        """The prior of a motion predicted as turn, chord, side (3,).

        Args:
            side_sigma: how sure the prediction is of its side, m.
            mount_sigma: (6,) how well the camera's place on the robot is known; an unknown lever
                arm looks like side slip in a turn, an unknown pitch like climbing.
        """
        turn, chord = motion[:2]
        turned, driven = abs(turn), abs(chord)
        side = side_sigma + np.hypot(self.side_per_turn, mount_sigma[0]) * turned
        side += np.hypot(self.side_per_chord, mount_sigma[5]) * driven + self.side_floor
        height = np.hypot(self.height_per_chord, mount_sigma[4]) * driven + self.height_floor
        tilt = self.tilt_floor + self.tilt_per_chord * driven
        roll = np.hypot(tilt, mount_sigma[3] * turned)
        pitch = np.hypot(tilt, mount_sigma[4] * turned)
        mean = np.concatenate([motion, np.zeros(3)])
        return MotionPrior(mean, np.array([_VAGUE_TURN, _VAGUE_CHORD, side, height, roll, pitch]))


VAGUE_SIDE = 1.0
"""m"""
_VAGUE_TURN, _VAGUE_CHORD = 1.0, 10.0
_FLAT = 1e-6  # m and rad: far below what pixels show, and still finite
