"""How sure a pose is that was found among scans whose own poses are uncertain.

A scan's pose follows those of the keyframes that it was laid over, each as far as it holds the
scan: x = H^-1 (sum of H_j x_j) + noise, where H_j is the information that came from keyframe j and
H their sum. The noise is the scan's own; that of a keyframe's scan is the same for all that are
laid over it, so that it belongs to x_j. Their covariance is kept jointly with that of the pose and
of the motion's constant errors. The keyframes are not corrected any more, only considered, as in
Schmidt's filter: the map stays as it was drawn.
"""

import numpy as np

from grouser.estimators.base import Observation
from grouser.estimators.line_slam.motion import MotionModel
from grouser.estimators.scan_matching.matcher import ScanMatch
from grouser.geometry import Array, wrap


class WindowFilter:
    """A pose (3,) in the frame of the start, the motion's n constant errors, and k keyframes."""

    def __init__(self, motion: MotionModel) -> None:
        self._motion = motion
        self.pose = np.zeros(3)
        self._errors = np.zeros(len(motion.errors))
        self._head = 3 + len(motion.errors)
        self._P = np.diag(np.concatenate([np.zeros(3), motion.errors.sigmas**2]))

    @property
    def covariance(self) -> Array:
        """(3, 3) of the pose."""
        return self._P[:3, :3].copy()

    def predict(self, observation: Observation) -> None:
        """Move the pose as the observation says."""
        step = self._motion.predict(observation, self.pose.copy(), self._errors.copy())
        F = np.eye(len(self._P))
        F[:3, :3], F[:3, 3 : self._head] = step.by_pose, step.by_errors
        self._P = F @ self._P @ F.T
        self._P[:3, :3] += step.covariance
        n = range(3, self._head)
        self._P[n, n] += self._motion.errors.walks**2
        self.pose = step.pose.copy()

    def learn(self, before: Array) -> None:
        """Tell the motion model where the step led that began at the pose `before` (3,)."""
        self._motion.learn(before, self.pose.copy())

    def remember(self, own_covariance: Array) -> None:
        """The pose becomes one more keyframe's.

        Args:
            own_covariance: (3, 3) in the robot's frame, of what noise in its scan moves, which is
                the same for all scans that are laid over it.
        """
        rows = [*range(len(self._P)), 0, 1, 2]
        self._P = self._P[np.ix_(rows, rows)]
        T = np.eye(3)
        c, s = np.cos(self.pose[2]), np.sin(self.pose[2])
        T[:2, :2] = [[c, -s], [s, c]]
        self._P[-3:, -3:] += T @ own_covariance @ T.T

    def forget_oldest(self, count: int) -> None:
        """The oldest keyframes leave the map."""
        gone = range(self._head, self._head + 3 * count)
        self._P = np.delete(np.delete(self._P, gone, axis=0), gone, axis=1)

    def relative_covariance(self, keyframe: Array) -> Array:
        """(3, 3) of the pose as seen from the newest keyframe, which is at the pose (3,)."""
        D = self._from_newest(keyframe)
        return np.asarray(D @ self._P @ D.T + _FLOOR)

    def correct(self, match: ScanMatch, guess_covariance: Array, keyframes: Array) -> None:
        """The pose becomes that of a match, which had this pose as its guess.

        The gain is the match's, by what is known of the pose from the newest keyframe: a gain by
        the whole covariance would move the pose away from the map, whose keyframes stay.

        Args:
            guess_covariance: (3, 3) that the match was given.
            keyframes: (k, 3) their poses.
        """
        P, head = self._P, self._head
        off = match.pose - self.pose
        off[2] = wrap(off[2])
        prior = np.linalg.inv(guess_covariance)
        posterior = np.linalg.inv(match.information + prior)
        by_pose = prior @ self._from_newest(keyframes[-1]) @ P[:, 3:head]  # of the errors, (3, n)
        by_information = np.zeros((len(P), 3))
        by_information[:3] = posterior
        by_information[3:head] = by_pose.T @ posterior
        # How far the match is off what the joint state expects, times the information.
        H = np.zeros((3, len(P)))
        H[:, :3] = match.information
        for j, keyframe in enumerate(keyframes):
            at = head + 3 * j
            H[:, at : at + 3] = -match.by_scan[j] @ _carried(keyframe, match.pose)
        J = np.eye(len(P)) - by_information @ H
        fresh = match.scan_share * match.information
        P = J @ P @ J.T + by_information @ fresh @ by_information.T
        self._P = (P + P.T) / 2
        self._errors = self._errors + by_pose.T @ off
        self.pose = match.pose.copy()

    def _from_newest(self, keyframe: Array) -> Array:
        """(3, m) derivative of the pose from the newest keyframe's by the whole state."""
        D = np.zeros((3, len(self._P)))
        D[:, :3], D[:, -3:] = np.eye(3), -_carried(keyframe, self.pose)
        return D


def _carried(keyframe: Array, pose: Array) -> Array:
    """(3, 3) how an error of a keyframe's pose (3,) moves a scan at the pose (3,) that it holds."""
    lever = pose[:2] - keyframe[:2]
    return np.array([[1.0, 0.0, -lever[1]], [0.0, 1.0, lever[0]], [0.0, 0.0, 1.0]])


_FLOOR = np.diag([0.01, 0.01, 0.003]) ** 2  # m, m, rad: of any guess, so that a match can differ
