"""What a chassis is likely to do between two frames: planar and non-holonomic, with a sigma.

The paper takes both for laws. A real chassis rolls and pitches by tenths of a degree a frame and
slips sideways, which at 20 m range is pixels; so they are priors here, stated in one place.
"""

from dataclasses import dataclass

import numpy as np

from grouser.estimators.visual.planar import ChassisTolerance
from grouser.geometry import Array


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

    def sigma(self, turn: float, chord: float, mount_sigma: Array) -> Array:
        """(6,) sigma of a motion (see `visual.motion`); turn and chord have a vague prior here.

        mount_sigma: (6,) how well the camera's place on the robot is known; an unknown lever arm
        looks like side slip in a turn, an unknown pitch like climbing.
        """
        turned, driven = abs(turn), abs(chord)
        side = np.hypot(self.side_per_turn, mount_sigma[0]) * turned
        side += np.hypot(self.side_per_chord, mount_sigma[5]) * driven + self.side_floor
        height = np.hypot(self.height_per_chord, mount_sigma[4]) * driven + self.height_floor
        tilt = self.tilt_floor + self.tilt_per_chord * driven
        roll = np.hypot(tilt, mount_sigma[3] * turned)
        pitch = np.hypot(tilt, mount_sigma[4] * turned)
        return np.array([_VAGUE_TURN, _VAGUE_CHORD, side, height, roll, pitch])


_VAGUE_TURN, _VAGUE_CHORD = 1.0, 10.0


def tolerance(sigma: Array) -> ChassisTolerance:
    """What one-point hypotheses must tolerate under the prior sigma (6,) of a motion."""
    return ChassisTolerance(height=float(sigma[3]), roll=float(sigma[4]), pitch=float(sigma[5]))
