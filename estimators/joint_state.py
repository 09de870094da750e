"""Poses at several times in one Kalman filter: now, at the keyframe, and the heading at a mark.

What a sensor measures between two times (vision since a keyframe, a gyroscope since its last
reading) is no measurement of the pose now, and treated as one it collapses the covariance (SPEC
1.5). So the poses at those times are kept in the state beside the one now: stochastic cloning
(Roumeliotis and Burdick, "Stochastic cloning", ICRA 2002). Position fixes then correct all of them.

The state is (pose, keyframe, mark, biases), 7 + n numbers: constant errors of tracks and sensors
are the biases. Every step is a function of one state that returns another one.
"""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from grouser.estimators.visual.prediction import Increment
from grouser.geometry import Array, between, between_jacobians, compose, compose_jacobians, wrap

POSE, KEYFRAME, MARK = slice(0, 3), slice(3, 6), 6
BIASES_FROM = 7


class Measurement(NamedTuple):
    """What a sensor says of the state, to first order."""

    innovation: Array
    """(m,) measured minus expected"""
    by_state: Array
    """(m, 7 + n) derivative of what is expected"""
    covariance: Array
    """(m, m) of the sensor's own noise"""

    def row(self, index: int) -> "Measurement":
        """One of its m numbers alone."""
        at = slice(index, index + 1)
        return Measurement(self.innovation[at], self.by_state[at], self.covariance[at, at])


@dataclass(frozen=True, slots=True, eq=False)
class JointState:
    """Poses and biases with their joint covariance."""

    pose: Array
    """(3,) now"""
    keyframe: Array
    """(3,) when the keyframe was taken"""
    mark: float
    """Heading at the mark, rad"""
    biases: Array
    """(n,)"""
    covariance: Array
    """(7 + n, 7 + n)"""
    white: Array
    """(3, 3) the part of the pose's covariance that the increments' white noise has added since the
    keyframe, of those that were not doubted"""

    @staticmethod
    def at_start(bias_sigmas: Array) -> "JointState":
        """At pose zero, known exactly, without any bias."""
        covariance = np.diag(np.concatenate([np.zeros(BIASES_FROM), bias_sigmas**2]))
        return JointState(
            np.zeros(3), np.zeros(3), 0.0, np.zeros(len(bias_sigmas)), covariance, np.zeros((3, 3))
        )

    @property
    def pose_covariance(self) -> Array:
        """(3, 3)"""
        return self.covariance[POSE, POSE].copy()

    @property
    def bias_covariance(self) -> Array:
        """(n, n)"""
        return self.covariance[BIASES_FROM:, BIASES_FROM:].copy()

    @property
    def relative(self) -> Array:
        """(3,) the pose as seen from the keyframe."""
        return between(self.keyframe, self.pose)

    def then(self, increment: Increment) -> "JointState":
        """Moved on by an increment; its constant errors are the first of the biases."""
        by_pose, by_increment = compose_jacobians(self.pose, increment.pose)
        F = np.eye(len(self.covariance))
        own = slice(BIASES_FROM, BIASES_FROM + increment.by_biases.shape[1])
        F[POSE, POSE], F[POSE, own] = by_pose, by_increment @ increment.by_biases
        noise = by_increment @ increment.covariance @ by_increment.T
        covariance = F @ self.covariance @ F.T
        covariance[POSE, POSE] += noise
        white = by_pose @ self.white @ by_pose.T + noise
        pose = compose(self.pose, increment.pose)
        return replace(self, pose=pose, covariance=_symmetric(covariance), white=_symmetric(white))

    def wandered(self, sigmas: Array) -> "JointState":
        """With biases that wandered on by so much, (n,)."""
        covariance = self.covariance.copy()
        covariance[BIASES_FROM:, BIASES_FROM:] += np.diag(sigmas**2)
        return replace(self, covariance=covariance)

    def doubted(self, inflation: float) -> "JointState":
        """As if the increments since the keyframe were noisier: so many times the variance, of each
        that was not doubted before. A second doubt of the same is not another."""
        covariance = self.covariance.copy()
        covariance[POSE, POSE] += (inflation - 1) * self.white
        return replace(self, covariance=covariance, white=np.zeros((3, 3)))

    def displaced(self, sigma: float) -> "JointState":
        """As if the robot had been moved in any direction, by so much [m]."""
        covariance = self.covariance.copy()
        covariance[:2, :2] += sigma**2 * np.eye(2)
        return replace(self, covariance=covariance)

    def corrected(self, measurement: Measurement) -> "JointState":
        """With a measurement taken into account."""
        H, P = measurement.by_state, self.covariance
        S = H @ P @ H.T + measurement.covariance
        K = np.linalg.solve(S, H @ P).T
        change = K @ measurement.innovation
        # Joseph's form: of two poses known to be the same, the difference stays semi-definite.
        A = np.eye(len(P)) - K @ H
        covariance = A @ P @ A.T + K @ measurement.covariance @ K.T
        return replace(
            self,
            pose=_moved(self.pose, change[POSE]),
            keyframe=_moved(self.keyframe, change[KEYFRAME]),
            mark=self.mark + float(change[MARK]),
            biases=self.biases + change[BIASES_FROM:],
            covariance=_symmetric(covariance),
        )

    def nis(self, measurement: Measurement) -> float:
        """Squared innovation over its covariance: chi-square of m degrees of freedom."""
        H = measurement.by_state
        S = H @ self.covariance @ H.T + measurement.covariance
        return float(measurement.innovation @ np.linalg.solve(S, measurement.innovation))

    def with_keyframe(self) -> "JointState":
        """The pose now becomes the keyframe."""
        covariance = self.covariance.copy()
        covariance[KEYFRAME] = covariance[POSE]
        covariance[:, KEYFRAME] = covariance[:, POSE]
        return replace(
            self, keyframe=self.pose.copy(), covariance=covariance, white=np.zeros((3, 3))
        )

    def with_mark(self) -> "JointState":
        """The heading now becomes the mark."""
        covariance = self.covariance.copy()
        covariance[MARK] = covariance[2]
        covariance[:, MARK] = covariance[:, 2]
        return replace(self, mark=float(self.pose[2]), covariance=covariance)

    def sees_relative(self, pose: Array, covariance: Array, by_biases: Array) -> Measurement:
        """The pose (3,) seen from the keyframe was measured; its error by the biases is (3, n)."""
        by_keyframe, by_pose = between_jacobians(self.keyframe, self.pose)
        H = np.zeros((3, len(self.covariance)))
        H[:, POSE], H[:, KEYFRAME], H[:, BIASES_FROM:] = by_pose, by_keyframe, by_biases
        innovation = pose - by_biases @ self.biases - self.relative
        innovation[2] = wrap(innovation[2])
        return Measurement(innovation, H, covariance)

    def sees_turn(self, turn: float, variance: float, by_biases: Array) -> Measurement:
        """The turn since the mark was measured [rad]; its error by the biases is (n,)."""
        H = np.zeros((1, len(self.covariance)))
        H[0, 2], H[0, MARK], H[0, BIASES_FROM:] = 1.0, -1.0, by_biases
        innovation = wrap(turn - by_biases @ self.biases - (self.pose[2] - self.mark))
        return Measurement(np.atleast_1d(innovation), H, np.array([[variance]]))

    def sees_position(self, position: Array, sigma: float) -> Measurement:
        """The position (2,) was measured [m]."""
        H = np.zeros((2, len(self.covariance)))
        H[:, :2] = np.eye(2)
        return Measurement(position - self.pose[:2], H, sigma**2 * np.eye(2))


def _moved(pose: Array, change: Array) -> Array:
    return np.append(pose[:2] + change[:2], wrap(pose[2] + change[2]))


def _symmetric(covariance: Array) -> Array:
    return (covariance + covariance.T) / 2
