"""Bullet's body and our own do the same, and ours stays out of solid things."""

from collections.abc import Iterator

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from grouser.envs.simulation.motion import Motion, longitudinal_slip
from grouser.envs.simulation.robot import DYNAMICS, RobotModel, TrackedRobot
from grouser.envs.simulation.world import Boxes, Cylinders, World
from grouser.envs.simulation.worlds.registry import make_world
from grouser.geometry import Array, project
from tests.envs.simulation.grounds import box, mechanical_energy, open_world, put, trunk

MODEL = RobotModel()
ROBOTS = {name: TrackedRobot(MODEL, dt=0.1, dynamics=name) for name in DYNAMICS}
FAST = ROBOTS["fast"]


@pytest.fixture(autouse=True, scope="module")
def close() -> Iterator[None]:
    yield
    for robot in ROBOTS.values():
        robot.close()


def drive(robot: TrackedRobot, world: World, command: tuple[float, float], n: int) -> list[Motion]:
    robot.enter(world)
    return [robot.step(command) for _ in range(n)]


STRAIGHT, ARC, SPOT = (0.4, 0.4), (0.5, 0.2), (-0.25, 0.25)


@pytest.mark.parametrize("command", [STRAIGHT, ARC, SPOT])
@pytest.mark.parametrize(
    "world",
    [
        open_world(),
        open_world("mud"),
        open_world("grass", heading=1.0),
        open_world(slope_degrees=15),
        open_world("asphalt", slope_degrees=15, heading=np.pi / 2),
    ],
)
def test_slip_and_yaw_rate_agree(world: World, command: tuple[float, float]) -> None:
    one, other = (drive(robot, world, command, 25) for robot in ROBOTS.values())
    for bullet, fast in zip(one[5:], other[5:], strict=True):
        slips = [longitudinal_slip(motion, MODEL.tracks.gauge) for motion in (bullet, fast)]
        np.testing.assert_allclose(slips[1], slips[0], rtol=0.05, atol=1e-6)
        np.testing.assert_allclose(fast.twist, bullet.twist, rtol=0.05, atol=1e-6)


def test_the_poses_agree_after_a_drive_over_steps() -> None:
    world = open_world(slabs=box(1.5, 0.0, (1.0, 2.0, 0.08), yaw=0.4))
    one, other = (drive(robot, world, (0.4, 0.35), 80)[-1] for robot in ROBOTS.values())
    np.testing.assert_allclose(other.T_world_base, one.T_world_base, atol=0.01)


@pytest.mark.parametrize(
    "obstacle",
    [
        {"solids": box(1.3, 0.0, (0.4, 4.0, 1.0))},
        {"solids": box(1.3, 0.0, (0.2, 0.2, 0.6))},
        {"solids": box(1.3, 0.0, (0.3, 0.3, 0.6), yaw=np.pi / 4)},
        {"cylinders": trunk(1.3, 0.0, 0.15)},
        {"cylinders": trunk(1.3, 0.0, 0.03)},
    ],
    ids=["wall", "post", "corner", "trunk", "sapling"],
)
def test_both_stop_at_the_same_place(obstacle: dict[str, Boxes | Cylinders]) -> None:
    world = open_world(**obstacle)  # type: ignore[arg-type]
    ends = {name: drive(robot, world, (0.5, 0.5), 60)[-1] for name, robot in ROBOTS.items()}
    for motion in ends.values():
        assert motion.collision and motion.contacts > 0
        assert motion.T_world_base[2, 2] > 0.99
    np.testing.assert_allclose(
        ends["fast"].T_world_base[:2, 3], ends["bullet"].T_world_base[:2, 3], atol=0.02
    )


@pytest.mark.parametrize("dynamics", DYNAMICS)
@pytest.mark.parametrize("low", [0.0, 2.0])
def test_what_is_lower_or_higher_than_the_hull_is_not_hit(dynamics: str, low: float) -> None:
    size = (0.2, 0.2, 0.10) if low == 0 else (1.0, 1.0, 0.5)
    thing = box(1.0, 0.0, size)
    raised = Boxes(thing.centre + [0, 0, low], thing.half_extents, thing.yaw, thing.texture)
    motions = drive(ROBOTS[dynamics], open_world(solids=raised), (0.5, 0.5), 50)
    assert not any(motion.collision for motion in motions)
    assert motions[-1].T_world_base[0, 3] > 2


@pytest.mark.parametrize("dynamics", DYNAMICS)
def test_the_robot_slides_along_a_wall(dynamics: str) -> None:
    world = open_world(solids=box(3.0, 0.6, (10.0, 0.4, 1.0)), heading=0.3)
    end = drive(ROBOTS[dynamics], world, (0.4, 0.4), 80)[-1].T_world_base
    x, y, heading = project(end)
    assert x > 1.0 and abs(heading) < 0.35
    hull_reach = MODEL.length / 2 * np.sin(abs(heading)) + MODEL.hull_width / 2 * np.cos(heading)
    assert y + hull_reach < 0.4 + 0.02


def hull_corners(motion: Motion) -> Array:
    """(8, 3) in the world frame."""
    centre, half = MODEL.hull
    signs = np.array([[i, j, k] for i in (-1, 1) for j in (-1, 1) for k in (-1, 1)])
    T = motion.T_world_base
    return np.asarray((centre + signs * half) @ T[:3, :3].T + T[:3, 3])


def deepest_in_box(world: World, motion: Motion) -> float:
    """How far a corner of the hull is inside a solid, m."""
    s = world.solids
    d = hull_corners(motion)[:, None] - s.centre
    c, sn = np.cos(s.yaw), np.sin(s.yaw)
    own = np.stack([c * d[..., 0] + sn * d[..., 1], c * d[..., 1] - sn * d[..., 0], d[..., 2]], -1)
    return float(np.min(s.half_extents - np.abs(own), axis=-1).max())


@settings(max_examples=12, deadline=None)
@given(seed=st.integers(0, 2**32 - 1))
def test_the_fast_body_neither_tunnels_nor_explodes(seed: int) -> None:
    """Two minutes each at up to full speed among boxes and along walls, wherever they lead."""
    rng = np.random.default_rng(seed)
    world = make_world("yard", rng)
    FAST.enter(world)
    for _ in range(80):
        command = rng.choice([-0.5, 0.2, 0.5], 2, p=[0.2, 0.2, 0.6])
        for motion in (FAST.step(command) for _ in range(15)):
            assert np.abs(motion.T_world_base[:2, 3]).max() < 9.0
            assert motion.T_world_base[2, 2] > 0.98 and np.abs(motion.twist[:2]).max() < 0.6
            if motion.collision:
                assert deepest_in_box(world, motion) < 0.02
        assert mechanical_energy(FAST) < 0.5 * MODEL.mass * 0.6**2 + MODEL.mass * 9.81 * 0.12


@settings(max_examples=25, deadline=None)
@given(
    radius=st.floats(0.02, 0.4),
    aside=st.floats(-0.2, 0.2),
    heading=st.floats(-np.pi, np.pi),
    reverse=st.booleans(),
)
def test_no_trunk_is_driven_through(
    radius: float, aside: float, heading: float, reverse: bool
) -> None:
    way = np.array([np.cos(heading), np.sin(heading)]) * (-1 if reverse else 1)
    place = 1.0 * way + aside * np.array([-way[1], way[0]])
    world = open_world(cylinders=trunk(place[0], place[1], radius), heading=heading)
    speed = -0.5 if reverse else 0.5
    collided = False
    for motion in drive(FAST, world, (speed, speed), 60):
        collided = collided or motion.collision
        centre, half = MODEL.hull
        T = motion.T_world_base
        axis = np.array([*place, T[2, 3] + centre[2]])
        own = (axis - T[:3, 3]) @ T[:3, :3] - centre
        gap = np.linalg.norm(np.maximum(np.abs(own[:2]) - half[:2], 0))
        assert gap > radius - 0.02
    assert collided


@pytest.mark.parametrize("dynamics", DYNAMICS)
@pytest.mark.parametrize("material", ["gravel", "asphalt", "mud", "ice"])
def test_a_robot_let_go_gains_no_energy(dynamics: str, material: str) -> None:
    """Dropped, thrown sideways and onto a step: springs give back less than they took."""
    robot = ROBOTS[dynamics]
    for velocity, tilt in (((0, 0, 0), (0.2, 0.1, 0)), ((0.8, 0.9, 0), (0, 0, 0.5))):
        world = open_world(material, slabs=box(0.6, 0.5, (0.4, 0.4, 0.08), yaw=0.3))
        put(robot, world, above=0.1, rotation_vector=tilt, velocity=velocity)
        most = mechanical_energy(robot)
        for _ in range(40):
            robot.step((0, 0))
            assert mechanical_energy(robot) < most + 1e-6


@pytest.mark.parametrize("dynamics", DYNAMICS)
@pytest.mark.parametrize("tip", [(1.8, 0, 0), (0, 1.7, 0), (np.pi, 0, 0)])
def test_a_robot_that_tips_over_comes_to_lie_on_the_ground(
    dynamics: str, tip: tuple[float, float, float]
) -> None:
    """On its side, its nose, its back or its tracks, but not in the ground."""
    robot = ROBOTS[dynamics]
    put(robot, open_world(), above=0.5, rotation_vector=tip)
    motion = [robot.step((0, 0)) for _ in range(50)][-1]
    soles = np.array([[x, y, 0.0] for x in (-0.25, 0.25) for y in (-0.2, 0.2)])
    T = motion.T_world_base
    lowest = min((soles @ T[:3, :3].T + T[:3, 3])[:, 2].min(), hull_corners(motion)[:, 2].min())
    assert -0.01 < lowest < 0.01
    assert np.abs(motion.twist).max() < 0.01


@pytest.mark.parametrize("dynamics", DYNAMICS)
def test_a_weak_motor_turns_the_robot(dynamics: str) -> None:
    robot = ROBOTS[dynamics]
    robot.enter(open_world())
    healthy = [robot.step((0.4, 0.4)) for _ in range(20)][-1]
    weak = [robot.step((0.4, 0.4), power=(0.5, 1.0)) for _ in range(20)][-1]
    assert abs(healthy.twist[2]) < 1e-6
    np.testing.assert_allclose(weak.track_speed, [0.2, 0.4], atol=1e-6)
    assert weak.twist[2] > 0.2


@pytest.mark.parametrize("dynamics", DYNAMICS)
def test_a_torn_belt_pulls_nothing(dynamics: str) -> None:
    """Uphill, the other track turns the robot towards the torn one, which spins at full speed."""
    robot = ROBOTS[dynamics]
    robot.enter(open_world(slope_degrees=10))
    for _ in range(10):
        robot.step((0.4, 0.4))
    torn = [robot.step((0.4, 0.4), traction=(1.0, 0.0)) for _ in range(8)][-1]
    np.testing.assert_allclose(torn.track_speed, [0.4, 0.4], atol=1e-3)
    assert torn.twist[2] < -0.01
    limp = [robot.step((0.4, 0.4), traction=(0.0, 0.0)) for _ in range(30)][-1]
    assert limp.twist[0] < 0  # it rolls back
