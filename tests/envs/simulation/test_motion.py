"""Slip ratios and centres of rotation, on motions whose answers are known."""

import math

import numpy as np
import pytest

from grouser.envs.simulation.motion import (
    Motion,
    instantaneous_centres,
    longitudinal_slip,
    motion_from_history,
)
from grouser.envs.simulation.robot import PHYSICS_DT
from grouser.envs.simulation.track_law import rotation_of
from grouser.geometry import Array, inverse_transform, rotation_from_rpy, so3_exp

GAUGE = 0.4


def motion(twist: tuple[float, float, float], track_speed: tuple[float, float]) -> Motion:
    return Motion(
        T_world_base=np.eye(4),
        twist=np.array(twist),
        track_speed=np.array(track_speed),
        track_travel=np.array(track_speed) * 0.1,
        specific_force=np.zeros(3),
        angular_rate=np.zeros(3),
        contacts=0,
        collision=False,
        path=np.tile([0.0, 0, 0, 0, 0, 0, 1], (25, 1)),
    )


@pytest.mark.parametrize(
    ("twist", "track_speed", "slip"),
    [
        ((0.3, 0.0, 0.0), (0.3, 0.3), (0.0, 0.0)),  # rolling
        ((0.2, 0.0, 0.0), (0.4, 0.4), (0.5, 0.5)),  # half of it is lost
        ((-0.2, 0.0, 0.0), (-0.4, -0.4), (0.5, 0.5)),  # the same backwards
        ((0.0, 0.0, 0.0), (0.4, -0.4), (1.0, 1.0)),  # spinning on the spot
        ((0.4, 0.0, 0.0), (0.2, 0.2), (-0.5, -0.5)),  # braking
        ((0.4, 0.0, 0.0), (0.0, 0.0), (-1.0, -1.0)),  # locked
        ((-0.1, 0.0, 0.0), (0.2, 0.2), (1.5, 1.5)),  # dragged against its tracks
        ((0.0, 0.0, 1.0), (-0.2, 0.2), (0.0, 0.0)),  # an ideal spot turn
        ((0.0, 0.0, 0.0), (0.0, 0.0), (0.0, 0.0)),  # at rest
    ],
)
def test_slip_ratio(
    twist: tuple[float, float, float], track_speed: tuple[float, float], slip: tuple[float, float]
) -> None:
    np.testing.assert_allclose(
        longitudinal_slip(motion(twist, track_speed), GAUGE), slip, atol=1e-12
    )


def test_centres_of_rotation_of_ideal_tracks_lie_on_the_tracks() -> None:
    left, right, along = instantaneous_centres(motion((0.3, 0.0, 0.5), (0.2, 0.4)))
    assert (left, right, along) == pytest.approx((GAUGE / 2, -GAUGE / 2, 0.0))


def test_centres_of_rotation_are_at_rest_on_the_ground() -> None:
    """The defining property: a point of the plane that moves with a track stands still."""
    vx, vy, w, u = 0.21, -0.03, 0.4, (0.1, 0.45)
    left, right, along = instantaneous_centres(motion((vx, vy, w), u))
    for y, speed in ((left, u[0]), (right, u[1])):
        assert vx - w * y - speed == pytest.approx(0.0)
    assert vy + w * along == pytest.approx(0.0)
    assert left - right == pytest.approx((u[1] - u[0]) / w)  # the effective width


def test_a_robot_that_does_not_turn_has_no_centre_of_rotation() -> None:
    assert np.all(np.isnan(instantaneous_centres(motion((0.3, 0.0, 0.0), (0.3, 0.3)))))


def quaternion(roll: float, pitch: float, yaw: float) -> Array:
    cr, sr, cp, sp = np.cos(roll / 2), np.sin(roll / 2), np.cos(pitch / 2), np.sin(pitch / 2)
    cy, sy = np.cos(yaw / 2), np.sin(yaw / 2)
    return np.array(
        [
            sr * cp * cy - cr * sp * sy,
            cr * sp * cy + sr * cp * sy,
            cr * cp * sy - sr * sp * cy,
            cr * cp * cy + sr * sp * sy,
        ]
    )


def test_quaternions_turn_as_roll_pitch_yaw_do() -> None:
    state, R = np.zeros(13), np.empty((3, 3))
    state[3:7] = quaternion(0.3, -0.4, 2.0)
    rotation_of(state, R)
    np.testing.assert_allclose(R, rotation_from_rpy(0.3, -0.4, 2.0), atol=1e-12)


def steadily_moving(n: int, h: float = 0.1) -> Array:
    """(n + 1, 13) a body that moves forwards at 0.3 m/s and turns at 0.6 rad/s, pitched by 0.2."""
    history = np.zeros((n + 1, 13))
    for k in range(n + 1):
        yaw = 0.6 * k * PHYSICS_DT
        R = rotation_from_rpy(0.0, 0.2, yaw)
        origin = 0.5 * np.array([np.sin(yaw), 1 - np.cos(yaw), 0.0])
        history[k, :3] = origin + h * R[:, 2]
        history[k, 3:7] = quaternion(0.0, 0.2, yaw)
        history[k, 10:13] = [0.0, 0.0, 0.6]
        history[k, 7:10] = 0.3 * np.array([np.cos(yaw), np.sin(yaw), 0.0])
        history[k, 7:10] += np.cross(history[k, 10:13], h * R[:, 2])
    return history


def summarised(history: Array, h: float = 0.1) -> Motion:
    return motion_from_history(history, np.zeros(2), com_height=h, contacts=0, collision=False)


def test_the_path_is_that_of_the_origin() -> None:
    n = 24
    m = summarised(steadily_moving(n))
    assert m.path.shape == (n + 1, 7)
    angle = 0.6 * n * PHYSICS_DT
    np.testing.assert_allclose(m.path[0, :3], 0, atol=1e-12)
    np.testing.assert_allclose(m.path[-1, :3], m.T_world_base[:3, 3])
    np.testing.assert_allclose(
        m.path[-1, :3], [0.5 * np.sin(angle), 0.5 * (1 - np.cos(angle)), 0], atol=1e-12
    )


@pytest.mark.parametrize("age", [0.0, PHYSICS_DT, 0.0123, 0.05, 0.1])
def test_a_pose_of_the_past_lies_on_the_path(age: float) -> None:
    m = summarised(steadily_moving(24))
    yaw = 0.6 * (0.1 - age)
    T = m.pose_at(age)
    np.testing.assert_allclose(T[:3, :3], rotation_from_rpy(0, 0.2, yaw), atol=1e-6)
    np.testing.assert_allclose(T[:2, 3], [0.5 * np.sin(yaw), 0.5 * (1 - np.cos(yaw))], atol=1e-6)
    assert T[3].tolist() == [0, 0, 0, 1]


def test_no_pose_lies_outside_the_step() -> None:
    m = summarised(steadily_moving(24))
    assert np.array_equal(m.pose_at(0.0), m.T_world_base)
    assert np.array_equal(m.pose_at(-1.0), m.T_world_base)
    np.testing.assert_array_equal(m.pose_at(0.3), m.pose_at(0.1))


def test_either_of_two_quaternions_is_the_same_pose() -> None:
    one = steadily_moving(24)
    other = one.copy()
    other[::2, 3:7] *= -1
    T_one, T_other = summarised(one).pose_at(0.0123), summarised(other).pose_at(0.0123)
    np.testing.assert_allclose(T_other, T_one, atol=1e-12)


def test_the_mean_twist_carries_the_pose_over_the_step() -> None:
    history = steadily_moving(24)
    history[:, 3:7] = [quaternion(0, 0, 0.6 * k * PHYSICS_DT) for k in range(25)]  # level
    history[:, 2] = 0.1
    history[:, :2] = 0.5 * np.column_stack(
        [np.sin(0.0025 * np.arange(25)), 1 - np.cos(0.0025 * np.arange(25))]
    )
    history[:, 7:9] = 0.3 * np.column_stack(
        [np.cos(0.0025 * np.arange(25)), np.sin(0.0025 * np.arange(25))]
    )
    m = summarised(history)
    np.testing.assert_allclose(m.twist, [0.3, 0.0, 0.6], atol=1e-12)
    turned = inverse_transform(m.pose_at(0.1)) @ m.T_world_base
    np.testing.assert_allclose(turned[:3, :3], so3_exp([0, 0, 0.06]), atol=1e-12)
    assert turned[0, 3] == pytest.approx(math.sin(0.06) / 0.06 * 0.03)


def test_a_rolling_body_moves_about_its_origin_on_the_ground() -> None:
    """Rolling at rate w about a point at the origin: the centre of mass, h above, moves at w h."""
    h, w = 0.1, 0.5
    state = np.zeros(13)
    state[2], state[6] = h, 1.0
    state[7], state[11] = w * h, w  # forwards, and nodding forwards
    m = summarised(np.tile(state, (3, 1)), h)
    np.testing.assert_allclose(m.twist, 0, atol=1e-12)
    np.testing.assert_allclose(m.T_world_base[:3, 3], 0, atol=1e-12)
    np.testing.assert_allclose(m.angular_rate, [0, w, 0])
    np.testing.assert_allclose(m.specific_force, [0, 0, 9.81])
