"""Slip ratios and centres of rotation, on motions whose answers are known."""

import math

import numpy as np
import pytest

from grouser.envs.simulation.motion import (
    Motion,
    instantaneous_centres,
    longitudinal_slip,
    motion_from_history,
    rotation_from_quaternion,
)
from grouser.geometry import rotation_from_rpy

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


def test_quaternions_turn_as_roll_pitch_yaw_do() -> None:
    r, p, y = 0.3, -0.4, 2.0
    cr, sr, cp, sp = math.cos(r / 2), math.sin(r / 2), math.cos(p / 2), math.sin(p / 2)
    cy, sy = math.cos(y / 2), math.sin(y / 2)
    q = [
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
        cr * cp * cy + sr * sp * sy,
    ]
    np.testing.assert_allclose(
        rotation_from_quaternion(np.array(q)), rotation_from_rpy(r, p, y), atol=1e-12
    )


def test_a_rolling_body_moves_about_its_origin_on_the_ground() -> None:
    """Rolling at rate w about a point at the origin: the centre of mass, h above, moves at w h."""
    h, w, dt = 0.1, 0.5, 1 / 240
    state = np.zeros(13)
    state[2], state[6] = h, 1.0
    state[7], state[11] = w * h, w  # forwards, and nodding forwards
    history = np.tile(state, (3, 1))
    m = motion_from_history(history, np.zeros(2), com_height=h, dt=dt, contacts=0, collision=False)
    np.testing.assert_allclose(m.twist, 0, atol=1e-12)
    np.testing.assert_allclose(m.T_world_base[:3, 3], 0, atol=1e-12)
    np.testing.assert_allclose(m.angular_rate, [0, w, 0])
    np.testing.assert_allclose(m.specific_force, [0, 0, 9.81])
