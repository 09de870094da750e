"""What the tracks say of the motion between two images, and how far they may be off.

Five constant errors are estimated along with the rest, because they never average out: the scales
of the left and right track and of the turn [1], the outward slip [m per rad] and the drag in turns
[m per rad]. Vision sees the last three; a scale that both tracks share it cannot see.
"""

import math
from dataclasses import dataclass, replace

import numpy as np

from grouser.estimators.dead_reckoning import outward_slip, turn_drag
from grouser.estimators.monocular.state import CONSTANTS, MOTION, SlamState
from grouser.estimators.track_motion import (
    TrackNoise,
    arc_jacobian,
    chord,
    track_increment,
    track_increment_jacobian,
)
from grouser.estimators.visual.prior import ChassisPrior
from grouser.geometry import Array, rotate
from grouser.rig import TrackGeometry

CONSTANT_NAMES = (
    "left track's scale",
    "right track's scale",
    "turn's scale",
    "outward slip [m/rad]",
    "drag in turns [m/rad]",
)
_PLANAR = slice(0, 3)  # turn, chord, side: what tracks tell and slip spoils


@dataclass(frozen=True, slots=True)
class Motion:
    """A predicted motion since the last image (see `visual.motion`)."""

    mean: Array
    """(6,)"""
    covariance: Array
    """(6, 6) of its white noise"""
    by_constants: Array
    """(6, 5)"""


@dataclass(frozen=True, slots=True)
class TrackModel:
    """The exact arc of the tracks' increments; what a chassis does besides is a prior."""

    tracks: TrackGeometry
    noise: TrackNoise
    turn_noise: float
    """White slip of a turn, as a share of it."""
    prior: ChassisPrior
    mount_sigma: Array
    """(6,) how well the camera's place on the robot is known"""

    def predict(self, du: Array, constants: Array) -> Motion:
        """The motion for increments du (2,) of the left and right track [m]."""
        width = self.tracks.effective_width
        true = du * (1 + constants[:2])
        turn, arc = track_increment(true, width)
        turn *= 1 + constants[2]
        outward = _outward(turn, arc, width)
        drag = turn_drag(turn, arc, width)
        length = arc - constants[4] * drag
        mean = np.array([turn, chord(turn, length), constants[3] * outward])

        by_arc = _chord_jacobian(turn, length)
        by_du = by_arc @ np.diag([1 + constants[2], 1.0]) @ track_increment_jacobian(width)
        by_constants = np.zeros((6, 5))
        by_constants[_PLANAR] = np.column_stack(
            [
                by_du * du,
                by_arc[:, 0] * turn / (1 + constants[2]),
                [0.0, 0.0, outward],
                -drag * by_arc[:, 1],
            ]
        )
        belief = self.prior.about(mean, 0.0, self.mount_sigma)
        covariance = np.diag(np.concatenate([np.zeros(2), belief.sigma[2:] ** 2]))
        covariance[_PLANAR, _PLANAR] += by_du @ self.noise.covariance(true) @ by_du.T
        slip = self.turn_noise * turn * by_arc[:, 0]
        covariance[_PLANAR, _PLANAR] += np.outer(slip, slip)
        return Motion(np.concatenate([mean, np.zeros(3)]), covariance, by_constants)

    def expect_again(self, last: Array) -> Motion:
        """Without a word from the tracks: as the last motion (6,), give or take an acceleration."""
        mean = np.concatenate([last[:3], np.zeros(3)])
        belief = self.prior.about(mean[:3], 0.0, self.mount_sigma)
        turn = _TURN_CHANGE + 0.1 * abs(last[0])
        along = _CHORD_CHANGE + 0.1 * abs(last[1])
        sigma = np.concatenate([[turn, along], belief.sigma[2:]])
        return Motion(mean, np.diag(sigma**2), np.zeros((6, 5)))


_TURN_CHANGE, _CHORD_CHANGE = math.radians(1.5), 0.02  # rad, m: sigma of a frame's acceleration


def _outward(turn: float, arc: float, width: float) -> float:
    """The side of the motion for an outward slip of 1 m per rad, m."""
    return float(rotate(-turn / 2, outward_slip(turn, arc, width)[:2])[1])


def _chord_jacobian(turn: float, arc: float) -> Array:
    """(3, 2) derivative of (turn, chord, side) by turn and arc length."""
    by_arc = arc_jacobian(turn, arc)
    along = np.array([math.cos(turn / 2), math.sin(turn / 2)]) @ by_arc[:2]
    return np.array([[1.0, 0.0], along, [0.0, 0.0]])


def moved(state: SlamState, motion: Motion, walk: float) -> SlamState:
    """The state with a motion of which so far only the prediction is known.

    Args:
        walk: how far every constant error wanders in one frame, one sigma.
    """
    P = state.covariance.copy()
    P[CONSTANTS, CONSTANTS] += walk**2 * np.eye(5)
    B = motion.by_constants
    P[MOTION] = B @ P[CONSTANTS]
    P[:, MOTION] = P[MOTION].T
    P[MOTION, MOTION] = B @ P[CONSTANTS, CONSTANTS] @ B.T + motion.covariance
    return replace(state, motion=motion.mean, covariance=P)
