"""The law itself, on single patches: how soil shears, what shoes carry, what ground resists."""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
import pytest

from grouser.envs.simulation.surface import Surface
from grouser.envs.simulation.track_law import Law, ground_wrench
from grouser.geometry import Array

MU, LOAD, MODULUS, DT = 0.8, 100.0, 0.003, 1e-3


def patches(n: int, spacing: float = 1.0) -> Law:
    """Two tracks of n patches in one line, 1 m below the centre of mass, and no hull."""
    points = np.tile([0.0, 0.0, -1.0], (2 * n, 1))
    return Law(
        points=points,
        part=np.repeat([0, 1], n),
        contact=np.zeros(n, np.int64),
        spacing=spacing,
        stiffness=np.tile([LOAD, 0.0], (3, 1)),
        lateral=np.ones(3),
        rutting=np.ones(3),
        reach=2.0,
    )


def plane(resistance: float = 0.0, slope: float = 0.0) -> Surface:
    """A plane a metre above the patches' depth, so that each carries its load."""
    x = np.array([-50.0, 50.0])
    return Surface(
        heights=np.tile(slope * x, (2, 1)),
        cell=100.0,
        origin=np.array([-50.0, -50.0]),
        material=np.zeros((1, 1), np.int64),
        table=np.array([[MU, MODULUS, resistance]]),
        slabs=np.empty((0, 9)),
        slab_material=0,
    )


def wrench_on(
    law: Law, surface: Surface, state: Array, shear: Array, speed: float = 0.0,
    traction: tuple[float, float] = (1.0, 1.0),
) -> Array:  # fmt: skip
    wrench, touched = np.empty(6), np.empty((len(law.points), 9))
    ground_wrench(
        state, np.eye(3), np.full(2, speed), np.array(traction), law, surface,
        np.empty(0, np.int64), 0, np.inf, DT, shear, touched, wrench,
    )  # fmt: skip
    return wrench


def standing(vx: float = 0.0, vy: float = 0.0) -> Array:
    """At height zero, so that patches are 1 m deep and bear LOAD."""
    state = np.zeros(13)
    state[6], state[7], state[8] = 1.0, vx, vy
    return state


def sideways_force(path: Sequence[float]) -> list[float]:
    """Force over friction of a still track that is dragged sideways along a path of metres."""
    law, surface, shear = patches(1), plane(), np.zeros((2, 2))
    forces = []
    for before, after in pairwise(path):
        wrench = wrench_on(law, surface, standing(vy=(after - before) / DT), shear)
        forces.append(-wrench[1] / (2 * MU * LOAD))
    return forces


@pytest.mark.parametrize("direction", [1, -1])
def test_fresh_shoes_enter_unsheared_and_carry_the_shear_along(direction: int) -> None:
    """A track that rolls without slip by half a patch; patches are ordered from the rear."""
    speed, n = 0.5 * direction, 4
    before = np.array([1.0, 2.0, 3.0, 4.0]) * 1e-4
    shear = np.zeros((2 * n, 2))
    shear[:, 0] = np.tile(before, 2)
    wrench_on(patches(n, spacing=1e-3), plane(), standing(vx=speed), shear, speed)
    ahead = np.append(before[1:], 0.0) if direction > 0 else np.append(0.0, before[:-1])
    np.testing.assert_allclose(shear[:n, 0], (before + ahead) / 2, rtol=1e-9)
    np.testing.assert_allclose(shear[n:], shear[:n], rtol=1e-12)


@pytest.mark.parametrize("direction", [1, -1])
def test_a_wheel_gets_nothing_from_the_wheel_before_it(direction: int) -> None:
    n, speed = 4, 0.5 * direction
    law = patches(n, spacing=1e-3)._replace(contact=np.array([0, 0, 1, 1]))
    shear = np.zeros((2 * n, 2))
    shear[:, 0] = 1e-4
    wrench_on(law, plane(), standing(vx=speed), shear, speed)
    first = [1, 0.5, 1, 0.5] if direction > 0 else [0.5, 1, 0.5, 1]
    np.testing.assert_allclose(shear[:n, 0], 1e-4 * np.array(first), rtol=1e-9)


def test_ground_sheared_one_way_follows_janosi_and_hanamoto() -> None:
    x = np.arange(0.0, 0.012, 1e-5)
    resting = [*x, x[-1], x[-1]]  # the last step is at rest, without damping
    assert sideways_force(resting)[-1] == pytest.approx(1 - np.exp(-x[-1] / MODULUS), rel=1e-9)
    slowly = [0.0, 1e-6, 1e-6]
    assert sideways_force(slowly)[-1] == pytest.approx(1e-6 / MODULUS, rel=1e-3)


def test_ground_sheared_forth_and_back_takes_energy() -> None:
    forth = np.arange(0.0, 0.006, 1e-5)
    path = np.concatenate([forth, forth[::-1], forth, forth[::-1]])
    force = np.array(sideways_force(path.tolist()))
    work = np.sum(force * np.diff(path))
    assert work > 0.25 * 4 * 0.006  # of what Coulomb friction takes; an elastic law would take 0


@pytest.mark.parametrize("speed", [0.5, -0.5])
def test_a_rolling_track_feels_the_motion_resistance_alone(speed: float) -> None:
    wrench = wrench_on(patches(1), plane(0.05), standing(vx=speed), np.zeros((2, 2)), speed)
    assert wrench[0] == pytest.approx(-np.sign(speed) * 0.05 * 2 * LOAD, rel=1e-2)


def test_motion_resistance_moves_nobody_at_rest() -> None:
    assert wrench_on(patches(1), plane(0.05), standing(), np.zeros((2, 2)))[0] == 0.0


@pytest.mark.parametrize("share", [1.0, 0.4, 0.0])
def test_a_torn_belt_passes_on_its_share_of_the_pull(share: float) -> None:
    """A spinning track pulls the robot forwards; the other one passes on everything."""
    shear = np.full((2, 2), 0.0)
    shear[:, 0] = -MODULUS  # fully sheared rearwards
    wrench = wrench_on(patches(1), plane(), standing(), shear, 0.5, traction=(share, 1.0))
    assert wrench[0] == pytest.approx((1 + share) * MU * LOAD, rel=1e-6)


@pytest.mark.parametrize("degrees", [5, 20])
def test_a_slope_carries_along_its_normal(degrees: float) -> None:
    slope = np.tan(np.radians(degrees))
    wrench = wrench_on(patches(1), plane(slope=slope), standing(), np.zeros((2, 2)))
    load = 2 * LOAD * np.cos(np.radians(degrees))  # the gap is measured along the normal
    np.testing.assert_allclose(
        wrench[:3], load * np.array([-np.sin(np.radians(degrees)), 0, np.cos(np.radians(degrees))])
    )
