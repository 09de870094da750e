"""Laws of the shear model: slip comes out of it, and it knows no preferred direction."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from grouser.envs.simulation.materials import MATERIALS, Material, material_index
from grouser.envs.simulation.motion import Motion, longitudinal_slip
from grouser.envs.simulation.robot import DYNAMICS, RobotModel, TrackedRobot
from grouser.envs.simulation.tracks import GRAVITY, TrackModel
from grouser.envs.simulation.world import Boxes, World
from grouser.envs.simulation.worlds.registry import make_world
from grouser.geometry import Array, between, project

GAUGE = TrackModel().gauge


@pytest.fixture(scope="module")
def world() -> World:
    return make_world("yard", np.random.default_rng(0))


@pytest.fixture(scope="module", params=DYNAMICS)
def robot(request: pytest.FixtureRequest) -> Iterator[TrackedRobot]:
    robot = TrackedRobot(RobotModel(), dt=0.1, dynamics=request.param)
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
    assert spot_turn_ratio(robot, world) == pytest.approx(0.66, abs=0.03)


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


def made_of(**properties: float) -> list[Material]:
    """Materials that differ from gravel in these properties."""
    gravel = MATERIALS[material_index("gravel")]
    return [replace(gravel, **properties)] * len(MATERIALS)  # type: ignore[arg-type]


def spot_turn_ratio_on(world: World, **properties: float) -> float:
    materials = made_of(**properties)
    robot = TrackedRobot(RobotModel(), dt=0.1, dynamics="fast", materials=materials)
    return spot_turn_ratio(robot, world)


def test_softer_ground_turns_the_robot_more(world: World) -> None:
    ratios = [spot_turn_ratio_on(world, shear_modulus=K) for K in (0.003, 0.010, 0.030)]
    assert all(stiffer < softer - 0.005 for stiffer, softer in pairwise(ratios)), ratios


def test_friction_does_not_change_a_spot_turn(world: World) -> None:
    """Coulomb: the ratio is one of lengths, where no motion resistance comes in."""
    ratios = [spot_turn_ratio_on(world, friction=mu, resistance=0.0) for mu in (0.3, 0.6, 1.0)]
    assert max(ratios) - min(ratios) < 0.02 * min(ratios), ratios


def test_motion_resistance_slows_a_spot_turn(world: World) -> None:
    ratios = [spot_turn_ratio_on(world, resistance=share) for share in (0.0, 0.03, 0.10)]
    assert all(more < less - 0.005 for less, more in pairwise(ratios)), ratios


def test_tracks_that_push_the_soil_sideways_turn_the_robot_less(world: World) -> None:
    ratios = []
    for factor in (1.0, 1.5):
        model = RobotModel(tracks=TrackModel(lateral_factor=factor))
        robot = TrackedRobot(model, dt=0.1, dynamics="fast")
        ratios.append(spot_turn_ratio(robot, world))
    assert ratios[1] < 0.9 * ratios[0]


def test_a_robot_on_wheels_turns_less_than_one_on_tracks(world: World) -> None:
    """Its weight stands at the ends. With points for wheels and Coulomb friction the ratio is
    b^2 / (a^2 + b^2) for half the gauge b and half the wheelbase a: .39 here."""
    tracks = TrackModel(axles=(-0.25, 0.25), contact_length=0.02, n_patches=3)
    robot = TrackedRobot(RobotModel(tracks=tracks), dt=0.1, dynamics="fast")
    assert spot_turn_ratio(robot, world) == pytest.approx(0.39, abs=0.03)


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
    friction = MATERIALS[material_index("gravel")].friction
    assert 1.0 < pull < friction * GRAVITY * 1.05


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


def test_a_control_step_is_a_multiple_of_the_physics_step() -> None:
    with pytest.raises(ValueError, match=r"no multiple of the physics step of 1/240 s.*0\.1 s"):
        TrackedRobot(RobotModel(), dt=0.101)


def test_unknown_dynamics_are_refused_with_those_there_are() -> None:
    with pytest.raises(ValueError, match="no dynamics are named 'havok'; known: bullet, fast"):
        TrackedRobot(RobotModel(), dt=0.1, dynamics="havok")


@pytest.mark.parametrize(
    ("part", "options", "words"),
    [
        (TrackModel, {"gauge": 0.0}, "TrackModel.gauge must be positive, got 0.0"),
        (TrackModel, {"n_patches": 1}, "n_patches must be at least 2, the ends of the contact"),
        (RobotModel, {"mass": -1.0}, "RobotModel.mass must be positive, got -1.0"),
        (RobotModel, {"hull_bottom": 0.3}, "hull_bottom must be above 0 and below hull_top, 0.22"),
    ],
)
def test_impossible_robots_are_refused(
    part: type[TrackModel] | type[RobotModel], options: dict[str, Any], words: str
) -> None:
    with pytest.raises(ValueError, match=words):
        part(**options)
