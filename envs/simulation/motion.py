"""What the robot truly did between two observations: the ideal input of every sensor, the truth."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from grouser.envs.simulation.tracks import GRAVITY
from grouser.geometry import Array, transform

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


def motion_from_history(
    history: Array,
    track_travel: Array,
    *,
    com_height: float,
    dt: float,
    contacts: int,
    collision: bool,
) -> Motion:
    """Summarise one step.

    Args:
        history: (n + 1, 13) states of the centre of mass before the step and after each of its n
            substeps, laid out as `track_wrench` says.
        track_travel: (2,) m.
        com_height: of the centre of mass above the robot's origin, m.
        dt: length of a substep, s.
    """
    R = rotation_from_quaternion(history[:, 3:7])
    offset = -com_height * R[:, :, 2]  # from the centre of mass to the origin, world frame
    velocity = history[:, 7:10] + np.cross(history[:, 10:13], offset)
    acceleration = np.diff(velocity, axis=0) / dt + [0.0, 0.0, GRAVITY]
    after = R[1:]
    twist = np.einsum("kji,kj->i", after, velocity[1:]) / len(after)
    rate = np.einsum("kji,kj->i", after, history[1:, 10:13]) / len(after)
    return Motion(
        T_world_base=transform(R[-1], history[-1, :3] + offset[-1]),
        twist=np.array([twist[0], twist[1], rate[2]]),
        track_speed=track_travel / (len(after) * dt),
        track_travel=track_travel,
        specific_force=np.einsum("kji,kj->i", after, acceleration) / len(after),
        angular_rate=rate,
        contacts=contacts,
        collision=collision,
    )


def longitudinal_slip(motion: Motion, gauge: float) -> Array:
    """(2,) slip ratio of the left and right track: (u - v) sign(u) / max(|u|, |v|).

    u is the speed of the track over its wheels, v that of the robot at the track's centre. 0 is
    pure rolling, 1 spinning on the spot, negative when braking, beyond 1 when the robot is dragged
    against the track; 0 where both rest. (Wong, Theory of Ground Vehicles, sec. 2.4.)
    """
    u = motion.track_speed
    v = motion.twist[0] + np.array([-0.5, 0.5]) * gauge * motion.twist[2]
    faster = np.maximum(np.abs(u), np.abs(v))
    direction = np.where(u == 0, np.sign(v), np.sign(u))
    moving = faster > STANDING_SPEED
    return np.where(moving, (u - v) * direction / np.where(moving, faster, 1.0), 0.0)


def instantaneous_centres(motion: Motion) -> Array:
    """(3,) y of the left track's, y of the right track's and x of the ICRs, m, robot frame.

    The point of the plane that moves with a track and rests on the ground: y_i = (v_x - u_i) / w,
    x = -v_y / w (Martinez, Mandow et al., "Approximating kinematics for tracked mobile robots",
    IJRR 2005, eqs. 1 to 3, in our axes). y_left - y_right is the effective width. NaN where the
    robot does not turn.
    """
    vx, vy, w = motion.twist
    if abs(w) < STRAIGHT_RATE:
        return np.full(3, np.nan)
    return np.array([*(vx - motion.track_speed) / w, -vy / w])


def rotation_from_quaternion(q: Array) -> NDArray[np.float64]:
    """Rotations (..., 3, 3) of unit quaternions (..., 4) in the order x, y, z, w."""
    x, y, z, w = np.moveaxis(q, -1, 0)
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)
