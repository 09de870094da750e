"""What the robot truly did between two observations: the ideal input of every sensor, the truth."""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from grouser.envs.simulation.dynamics import PHYSICS_DT
from grouser.envs.simulation.track_law import rotation_of
from grouser.envs.simulation.tracks import GRAVITY
from grouser.geometry import Array
from grouser.kernels import kernel, kernel_using

STANDING_SPEED = 1e-3
"""Below this a track and the ground under it count as at rest, m/s."""
STRAIGHT_RATE = 1e-3
"""Below this a robot counts as not turning, rad/s."""


@dataclass(frozen=True, slots=True, eq=False)
class Motion:
    """One control step, in the robot's frame unless the name says otherwise."""

    T_world_base: Array
    """(4, 4) pose at the end of the step."""
    twist: Array
    """(3,) forward [m/s], left [m/s], yaw rate [rad/s]; mean over the step."""
    track_speed: Array
    """(2,) left, right, m/s; mean over the step."""
    track_travel: Array
    """(2,) how far each track ran over its wheels, m; not how far the robot went."""
    specific_force: Array
    """(3,) m/s^2, mean over the step; (0, 0, 9.81) at rest."""
    angular_rate: Array
    """(3,) rad/s, mean over the step."""
    contacts: int
    """Points at which the robot touches an obstacle or a wall at the end of the step."""
    collision: bool
    """Whether it touched one at any time in the step."""
    path: Array
    """(n + 1, 7) position [m] and quaternion x y z w of the robot's origin in the world, before the
    step and after each of its substeps of PHYSICS_DT."""

    def pose_at(self, age: float) -> Array:
        """(4, 4) pose `age` seconds before the end of the step, but not before its beginning.

        Between two substeps the position is interpolated linearly, the quaternion too (and made a
        unit one again: a robot does not turn far in 1/240 s).
        """
        T = np.zeros((4, 4))
        _pose_at(self.path, age / PHYSICS_DT, T)
        return T


def motion_from_history(
    history: Array, track_travel: Array, *, com_height: float, contacts: int, collision: bool
) -> Motion:
    """Summarise one step.

    Args:
        history: (n + 1, 13) states of the centre of mass before the step and after each of its n
            substeps, laid out as `ground_wrench` says.
        track_travel: (2,) m.
        com_height: of the centre of mass above the robot's origin, m.
    """
    n = len(history) - 1
    T, means, path = np.zeros((4, 4)), np.zeros((3, 3)), np.empty((n + 1, 7))
    _summarise(history, com_height, PHYSICS_DT, T, means, path)
    return Motion(
        T_world_base=T,
        twist=means[0],
        track_speed=track_travel / (n * PHYSICS_DT),
        track_travel=track_travel,
        specific_force=means[1],
        angular_rate=means[2],
        contacts=contacts,
        collision=collision,
        path=path,
    )


@kernel_using(rotation_of)
def _summarise(
    history: Any, com_height: float, dt: float, T: Any, means: Any, path: Any
) -> None:  # fmt: skip
    """Write the last pose into T, into means (3, 3) the twist, specific force and angular rate in
    the robot's frame, and the path of the robot's origin."""
    n = history.shape[0] - 1
    R, velocity, before = np.empty((3, 3)), np.empty(3), np.empty(3)
    for k in range(n + 1):
        state = history[k]
        rotation_of(state, R)
        ox, oy, oz = -com_height * R[0, 2], -com_height * R[1, 2], -com_height * R[2, 2]
        velocity[0] = state[7] + state[11] * oz - state[12] * oy
        velocity[1] = state[8] + state[12] * ox - state[10] * oz
        velocity[2] = state[9] + state[10] * oy - state[11] * ox
        path[k, 0], path[k, 1], path[k, 2] = state[0] + ox, state[1] + oy, state[2] + oz
        path[k, 3:7] = state[3:7]
        if k > 0:
            for axis in range(3):
                for c in range(3):
                    force = (velocity[c] - before[c]) / dt + (GRAVITY if c == 2 else 0.0)
                    means[0, axis] += R[c, axis] * velocity[c] / n
                    means[1, axis] += R[c, axis] * force / n
                    means[2, axis] += R[c, axis] * state[10 + c] / n
        before[:] = velocity
    means[0, 2] = means[2, 2]  # forward, left, yaw rate
    T[:3, :3], T[:3, 3], T[3, 3] = R, path[n, :3], 1.0


@kernel_using(rotation_of)
def _pose_at(path: Any, substeps: float, T: Any) -> None:
    """Write into T the pose that many substeps before the end of a path."""
    n = path.shape[0] - 1
    at = min(max(n - substeps, 0.0), float(n))
    k = min(int(at), n - 1)
    later = at - k
    state = np.zeros(7)
    same_way = 0.0
    for c in range(3, 7):
        same_way += path[k, c] * path[k + 1, c]
    sign = 1.0 if same_way >= 0 else -1.0  # q and -q are the same rotation
    for c in range(7):
        state[c] = (1 - later) * path[k, c] + later * (sign if c > 2 else 1.0) * path[k + 1, c]
    norm = math.sqrt(state[3] ** 2 + state[4] ** 2 + state[5] ** 2 + state[6] ** 2)
    for c in range(3, 7):
        state[c] /= norm
    rotation = np.empty((3, 3))
    rotation_of(state, rotation)
    T[:3, :3], T[:3, 3], T[3, 3] = rotation, state[:3], 1.0


def longitudinal_slip(motion: Motion, gauge: float) -> Array:
    """(2,) slip ratio of the left and right track: (u - v) sign(u) / max(|u|, |v|).

    u is the speed of the track over its wheels, v that of the robot at the track's centre. 0 is
    pure rolling, 1 spinning on the spot, negative when braking, beyond 1 when the robot is dragged
    against the track; 0 where both rest. (Wong, Theory of Ground Vehicles, sec. 2.4.)
    """
    slip = np.empty(2)
    _slip(motion.track_speed, motion.twist, gauge, slip)
    return slip


@kernel
def _slip(track_speed: Any, twist: Any, gauge: float, out: Any) -> None:
    for side in range(2):
        u = track_speed[side]
        v = twist[0] + (side - 0.5) * gauge * twist[2]
        faster = max(abs(u), abs(v))
        forwards = u > 0 or (u == 0 and v > 0)
        out[side] = (u - v if forwards else v - u) / faster if faster > STANDING_SPEED else 0.0


def instantaneous_centres(motion: Motion) -> Array:
    """(3,) y of the left track's, y of the right track's and x of the ICRs, m, robot frame.

    The point of the plane that moves with a track and rests on the ground: y_i = (v_x - u_i) / w,
    x = -v_y / w (Martinez, Mandow et al., "Approximating kinematics for tracked mobile robots",
    IJRR 2005, eqs. 1 to 3, in our axes). y_left - y_right is the effective width. NaN where the
    robot does not turn.

    With the tracks' mean speeds u they give the mean twist back: w = (u_R - u_L) / (y_L - y_R),
    v_x = u_L + w y_L, v_y = -w x; and `compose(pose, exp(dt * twist))` the next pose, as far as the
    robot is level and the twist steady within the step. Where both tracks run alike and the ground
    turns the robot, y_left equals y_right and they say nothing of w.
    """
    vx, vy, w = motion.twist.tolist()
    left, right = motion.track_speed.tolist()
    if abs(w) < STRAIGHT_RATE:
        return np.full(3, np.nan)
    return np.array([(vx - left) / w, (vx - right) / w, -vy / w])
