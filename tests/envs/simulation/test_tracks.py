"""Laws of the shear model: slip comes out of it, and it knows no preferred direction."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from grouser.envs.simulation.motion import Motion, longitudinal_slip
from grouser.envs.simulation.robot import RobotModel, TrackedRobot
from grouser.envs.simulation.tracks import GRAVITY, TrackModel, track_wrench
from grouser.envs.simulation.world import Boxes, World
from grouser.envs.simulation.worlds.registry import make_world
from grouser.geometry import Array, between, project

GAUGE = TrackModel().gauge


@pytest.fixture(scope="module")
def world() -> World:
    return make_world("yard", np.random.default_rng(0))


@pytest.fixture(scope="module")
def robot() -> Iterator[TrackedRobot]:
    robot = TrackedRobot(RobotModel(), dt=0.1)
    yield robot
    robot.close()


def drive(
    robot: TrackedRobot, world: World, commands: Sequence[tuple[float, float]], heading: float = 0
) -> list[Motion]:
    """Motions of a drive from the world's origin; the first is the standing start."""
    start = np.array([0.0, 0.0, heading])
    motions = [robot.enter(replace(world, start=start))]
    return motions + [robot.step(np.array(command)) for command in commands]


def relative_poses(motions: Sequence[Motion]) -> Array:
    poses = np.array([project(m.T_world_base) for m in motions])
    return between(poses[0], poses)


def spot_turn_ratio(robot: TrackedRobot, world: World, heading: float = 0) -> float:
    """Yaw rate over that of tracks that do not slip."""
    motions = drive(robot, world, [(-0.3, 0.3)] * 20, heading)[10:]
    return float(np.mean([m.twist[2] for m in motions])) / (0.6 / GAUGE)


def test_a_spot_turn_is_slower_than_its_tracks_say(robot: TrackedRobot, world: World) -> None:
    assert spot_turn_ratio(robot, world) == pytest.approx(0.69, abs=0.03)


def test_a_robot_does_the_same_whatever_its_heading(robot: TrackedRobot, world: World) -> None:
    commands = [(0.5, 0.2)] * 8 + [(-0.3, 0.3)] * 8 + [(-0.1, -0.4)] * 8
    reference = relative_poses(drive(robot, world, commands))
    for heading in (0.2, 0.7, 1.3, -2.5):
        turned = relative_poses(drive(robot, world, commands, heading))
        np.testing.assert_allclose(turned, reference, atol=1e-7)


def test_left_and_right_are_mirror_images(robot: TrackedRobot, world: World) -> None:
    commands = [(0.5, 0.2)] * 10 + [(-0.3, 0.1)] * 10
    one = relative_poses(drive(robot, world, commands))
    other = relative_poses(drive(robot, world, [(right, left) for left, right in commands]))
    np.testing.assert_allclose(other, one * [1, -1, -1], atol=1e-9)


def test_forwards_and_backwards_are_mirror_images(robot: TrackedRobot, world: World) -> None:
    commands = [(0.5, 0.2)] * 10 + [(0.1, 0.3)] * 10
    one = relative_poses(drive(robot, world, commands))
    back = relative_poses(drive(robot, world, [(-left, -right) for left, right in commands]))
    np.testing.assert_allclose(back, one * [-1, 1, -1], atol=1e-9)


def test_a_straight_line_hardly_slips(robot: TrackedRobot, world: World) -> None:
    motions = drive(robot, world, [(0.4, 0.4)] * 30)
    assert np.max(np.abs(longitudinal_slip(motions[-1], GAUGE))) < 1e-3
    travelled, driven = relative_poses(motions)[-1], sum(m.track_travel[0] for m in motions)
    assert travelled[0] == pytest.approx(driven, rel=0.01)
    assert np.abs(travelled[1:]).max() < 1e-9


def test_softer_ground_turns_the_robot_more(world: World) -> None:
    ratios = []
    for shear_modulus in (0.003, 0.010, 0.030):
        tracks = TrackModel(shear_modulus=shear_modulus)
        robot = TrackedRobot(RobotModel(tracks=tracks), dt=0.1)
        ratios.append(spot_turn_ratio(robot, world))
        robot.close()
    assert all(stiffer < softer - 0.005 for stiffer, softer in pairwise(ratios)), ratios


def test_friction_does_not_change_a_spot_turn(world: World) -> None:
    """Coulomb: the ratio is one of lengths."""
    ratios = []
    for friction in (0.4, 0.8):
        robot = TrackedRobot(RobotModel(tracks=TrackModel(friction=friction)), dt=0.1)
        ratios.append(spot_turn_ratio(robot, world))
        robot.close()
    assert ratios[0] == pytest.approx(ratios[1], rel=0.03)


def test_a_parked_robot_stays(robot: TrackedRobot, world: World) -> None:
    motions = drive(robot, world, [(0.0, 0.0)] * 50, heading=0.4)
    assert np.abs(relative_poses(motions)[-1]).max() < 1e-12
    np.testing.assert_allclose(motions[-1].specific_force, [0, 0, GRAVITY], atol=1e-9)


def test_a_stopped_robot_comes_to_rest(robot: TrackedRobot, world: World) -> None:
    motions = drive(robot, world, [(0.5, 0.1)] * 10 + [(0.0, 0.0)] * 20)
    assert np.abs(motions[-1].twist).max() < 1e-6


def test_the_ground_pulls_no_harder_than_friction_allows(robot: TrackedRobot, world: World) -> None:
    motions = drive(robot, world, [(0.5, 0.5)] * 3 + [(-0.5, -0.5)] * 5)
    pull = max(abs(m.specific_force[0]) for m in motions)
    assert 1.0 < pull < robot.model.tracks.friction * GRAVITY * 1.05


def test_a_wall_stops_the_robot_and_is_reported(robot: TrackedRobot, world: World) -> None:
    facing_wall = replace(world, start=np.array([8.3, 0.0, 0.0]), solids=walls_only(world))
    robot.enter(facing_wall)
    motions = [robot.step(np.array([0.5, 0.5])) for _ in range(30)]
    assert not motions[0].collision and motions[0].contacts == 0
    assert motions[-1].collision and motions[-1].contacts > 0
    x = motions[-1].T_world_base[0, 3]
    assert x + robot.model.length / 2 == pytest.approx(9.0, abs=0.02)
    assert motions[-1].T_world_base[2, 2] > 0.999  # it stands upright
    assert longitudinal_slip(motions[-1], GAUGE)[0] > 0.95  # and its tracks spin
    away = [robot.step(np.array([-0.2, -0.2])) for _ in range(8)]
    assert any(m.collision and not m.contacts for m in away)  # it touched, and no longer does
    assert not away[-1].collision


def walls_only(world: World) -> Boxes:
    s, walls = world.solids, slice(len(world.solids) - world.n_walls, None)
    return Boxes(s.centre[walls], s.half_extents[walls], s.yaw[walls], s.texture[walls])


def sideways_force(path: Sequence[float]) -> list[float]:
    """Force over friction of a still track that is dragged sideways along a path of metres."""
    mu, load, modulus, dt = 0.8, 100.0, 0.003, 1e-3
    state, shear, wrench = np.zeros(13), np.zeros((2, 1, 2)), np.zeros(6)
    state[6] = 1.0
    forces = []
    for before, after in pairwise(path):
        state[8] = (after - before) / dt
        track_wrench(
            state, np.zeros(2), np.zeros(1), np.array([-1.0]), 0.0, mu, modulus, load, 0.0, 1.0, dt,
            shear, wrench,
        )  # fmt: skip
        forces.append(-wrench[1] / (2 * mu * load))
    return forces


@pytest.mark.parametrize("direction", [1, -1])
def test_fresh_shoes_enter_unsheared_and_carry_the_shear_along(direction: int) -> None:
    """A track that rolls without slip by half a patch; patches are ordered from the rear."""
    speed, dt, spacing, n = 0.5 * direction, 1e-3, 1e-3, 4
    state, wrench = np.zeros(13), np.zeros(6)
    state[6], state[7] = 1.0, speed
    before = np.array([1.0, 2.0, 3.0, 4.0]) * 1e-4
    shear = np.zeros((2, n, 2))
    shear[:, :, 0] = before
    track_wrench(
        state, np.full(2, speed), np.zeros(n), np.full(n, -1.0), 0.0, 0.8, 0.003, 100.0, 0.0,
        spacing, dt, shear, wrench,
    )  # fmt: skip
    ahead = np.append(before[1:], 0.0) if direction > 0 else np.append(0.0, before[:-1])
    np.testing.assert_allclose(shear[0, :, 0], (before + ahead) / 2, rtol=1e-9)
    np.testing.assert_allclose(shear[1], shear[0], rtol=1e-12)


def test_ground_sheared_one_way_follows_janosi_and_hanamoto() -> None:
    x = np.arange(0.0, 0.012, 1e-5)
    resting = [*x, x[-1], x[-1]]  # the last step is at rest, without damping
    assert sideways_force(resting)[-1] == pytest.approx(1 - np.exp(-x[-1] / 0.003), rel=1e-9)
    slowly = [0.0, 1e-6, 1e-6]
    assert sideways_force(slowly)[-1] == pytest.approx(1e-6 / 0.003, rel=1e-3)


def test_ground_sheared_forth_and_back_takes_energy() -> None:
    forth = np.arange(0.0, 0.006, 1e-5)
    path = np.concatenate([forth, forth[::-1], forth, forth[::-1]])
    force = np.array(sideways_force(path.tolist()))
    work = np.sum(force * np.diff(path))
    assert work > 0.25 * 4 * 0.006  # of what Coulomb friction takes; an elastic law would take 0


def test_a_control_step_is_a_multiple_of_the_physics_step() -> None:
    with pytest.raises(ValueError, match=r"no multiple of the physics step of 1/240 s.*0\.1 s"):
        TrackedRobot(RobotModel(), dt=0.101)
