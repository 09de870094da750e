"""A picture that stands while the tracks drive: they spin on the spot, or the camera is stuck.

One camera cannot tell which. Until a later picture does, both stay possible: the robot may be where
it was, or where the tracks say.
"""

from dataclasses import replace

import numpy as np

from grouser.estimators.monocular.camera import Projection
from grouser.estimators.monocular.kalman import compose
from grouser.estimators.monocular.motion_model import Motion, moved
from grouser.estimators.monocular.state import POSITION, ROTATION, SlamState
from grouser.estimators.visual.planar_motion import planar_pose, pose_motion, pose_to_motion
from grouser.estimators.visual.stillness import moves
from grouser.geometry import compose as composed
from grouser.geometry import compose_jacobians, wrap

_PLANAR, _SPATIAL = slice(0, 3), slice(3, 6)
_STILL = (
    1e-4  # rad and m of a motion (6,): what pushes in vain still shakes, and is no camera stuck
)


def at_rest(motion: Motion) -> Motion:
    """What is expected of a camera that stands while the tracks tell this motion."""
    return Motion(np.zeros(6), _STILL**2 * np.eye(6), np.zeros_like(motion.by_constants))


def worth_telling(motion: Motion) -> bool:
    """Whether a motion is so large that a picture would show that it was not."""
    return moves(planar_pose(motion.mean)[0])


def then(first: Motion, second: Motion) -> Motion:
    """Two motions of the tracks, one after the other."""
    (before, to_before), (step, to_step) = planar_pose(first.mean), planar_pose(second.mean)
    F, V = compose_jacobians(before, step)
    pose = composed(before, step)
    to_motion = pose_to_motion(pose)
    by_first, by_second = to_motion @ F @ to_before, to_motion @ V @ to_step
    covariance, by_constants = np.zeros((6, 6)), np.zeros_like(first.by_constants)
    for motion, by in ((first, by_first), (second, by_second)):
        covariance[_PLANAR, _PLANAR] += by @ motion.covariance[_PLANAR, _PLANAR] @ by.T
        covariance[_SPATIAL, _SPATIAL] += motion.covariance[_SPATIAL, _SPATIAL]
        by_constants[_PLANAR] += by @ motion.by_constants[_PLANAR]
    return Motion(np.concatenate([pose_motion(pose), np.zeros(3)]), covariance, by_constants)


def between_both(state: SlamState, motion: Motion, walk: float) -> SlamState:
    """Midway between where the robot was and where the tracks say, and so uncertain that it covers
    both ends; without the points, of which nobody knows where they are now seen.

    Args:
        state: with motion zero, where the picture began to stand.
        motion: of the tracks since.
        walk: as for `moved`.
    """
    pose, _ = planar_pose(motion.mean)
    half = np.append(pose[:2], wrap(pose[2])) / 2
    mean = np.concatenate([pose_motion(half), np.zeros(3)])
    after = compose(moved(without_points(state), replace(motion, mean=mean), walk), _NO_POINTS)
    covariance = after.covariance.copy()
    # In any direction: where it went hangs on where it headed, which is doubted as well.
    covariance[POSITION, POSITION] += (half[0] ** 2 + half[1] ** 2) * np.diag([1.0, 1.0, 0.0])
    up = state.T_start_base[:3, 2]
    covariance[ROTATION, ROTATION] += half[2] ** 2 * np.outer(up, up)
    return replace(after, covariance=covariance)


def without_points(state: SlamState) -> SlamState:
    """The state without its map."""
    return state.keeping(np.zeros(len(state.points), dtype=bool))


_NO_POINTS = Projection(np.zeros((0, 3)), np.zeros((0, 3, 3)), np.zeros((0, 3, 6)))
