"""What a tracked robot does on slopes, steps, sills and grounds of all kinds."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from grouser.envs.simulation.ground import Ground
from grouser.envs.simulation.materials import MATERIAL_NAMES, MATERIALS
from grouser.envs.simulation.motion import Motion, instantaneous_centres, longitudinal_slip
from grouser.envs.simulation.robot import RobotModel, TrackedRobot
from grouser.envs.simulation.surface import Surface
from grouser.envs.simulation.world import World, join
from grouser.envs.simulation.worlds.registry import make_world, world_names
from grouser.geometry import Array, between, compose, exp, project
from tests.envs.simulation.grounds import box, open_world

MODEL = RobotModel()
GAUGE = MODEL.tracks.gauge
ROBOT = TrackedRobot(MODEL, dt=0.1, dynamics="fast")


def drive(world: World, command: tuple[float, float], n: int) -> list[Motion]:
    return [ROBOT.enter(world), *(ROBOT.step(command) for _ in range(n))]


def height(motion: Motion) -> float:
    return float(motion.T_world_base[2, 3])


# --- slopes --------------------------------------------------------------------------------------


def uphill_slip(friction: float) -> float:
    """On 15 degrees of a soil of K = 10 mm, the one of the prototype's figures."""
    soil = replace(MATERIALS[0], friction=friction, shear_modulus=0.010, resistance=0.0)
    robot = TrackedRobot(MODEL, dt=0.1, dynamics="fast", materials=[soil] * len(MATERIALS))
    robot.enter(open_world(slope_degrees=15))
    motion = [robot.step((0.4, 0.4)) for _ in range(40)][-1]
    return float(longitudinal_slip(motion, GAUGE)[0])


def test_a_climb_slips_the_more_the_less_friction_there_is() -> None:
    assert uphill_slip(0.8) == pytest.approx(0.013, abs=0.004)
    assert uphill_slip(0.4) == pytest.approx(0.035, abs=0.012)


def test_motion_on_a_slope_keeps_to_it() -> None:
    start, *motions = drive(open_world(slope_degrees=15), (0.4, 0.4), 30)
    climbed = height(motions[-1]) - height(start)
    gone = motions[-1].T_world_base[0, 3] - start.T_world_base[0, 3]
    assert climbed / gone == pytest.approx(np.tan(np.radians(15)), rel=1e-3)
    np.testing.assert_allclose(
        motions[-1].T_world_base[:3, 2], [-np.sin(np.radians(15)), 0, np.cos(np.radians(15))],
        atol=5e-3,
    )  # fmt: skip


@pytest.mark.parametrize("heading", [0.0, 0.8, np.pi / 2, np.pi])
@pytest.mark.parametrize("material", ["gravel", "asphalt", "cement", "grass"])
def test_a_parked_robot_holds_on_a_slope(material: str, heading: float) -> None:
    """Within a millimetre in ten seconds, and at rest in the end."""
    motions = drive(open_world(material, slope_degrees=15, heading=heading), (0, 0), 100)
    moved = motions[-1].T_world_base[:3, 3] - motions[20].T_world_base[:3, 3]
    assert np.abs(moved).max() < 1e-3
    assert np.abs(motions[-1].twist).max() < 1e-4


def test_a_parked_robot_does_not_chatter_on_a_slope() -> None:
    path = np.concatenate([m.path for m in drive(open_world(slope_degrees=15), (0, 0), 60)[40:]])
    assert np.ptp(path, axis=0).max() < 1e-6


def test_a_robot_slides_down_on_ice() -> None:
    degrees = 10.0
    motions = drive(open_world("ice", slope_degrees=degrees), (0, 0), 20)
    held_by = next(m.friction + m.resistance for m in MATERIALS if m.name == "ice")
    falls = 9.81 * (np.sin(np.radians(degrees)) - held_by * np.cos(np.radians(degrees)))
    measured = (motions[15].twist[0] - motions[5].twist[0]) / 1.0
    assert measured == pytest.approx(-falls, rel=0.01)


def test_across_a_slope_the_robot_drifts_downhill() -> None:
    drifts = []
    for name in ("asphalt", "gravel", "grass", "mud"):
        world = open_world(name, slope_degrees=15, heading=np.pi / 2)
        drifts.append(drive(world, (0.4, 0.4), 30)[-1].twist[1])
    assert all(0 < firmer < softer for firmer, softer in pairwise(drifts)), drifts


# --- materials -----------------------------------------------------------------------------------


def test_straight_slip_grows_from_asphalt_to_mud() -> None:
    slips = [
        longitudinal_slip(drive(open_world(name), (0.4, 0.4), 40)[-1], GAUGE)[0]
        for name in ("asphalt", "cement", "gravel", "grass", "mud")
    ]
    assert all(1.2 * firmer < softer for firmer, softer in pairwise(slips)), slips
    assert slips[0] < 1e-3 and 0.01 < slips[-1] < 0.10


def test_each_patch_feels_the_ground_under_it() -> None:
    """The left track on asphalt, the right one on ice: braking turns the robot to the left."""
    halves = Ground(
        heights=np.zeros((3, 2)),
        material=np.array([[MATERIAL_NAMES.index("ice")], [MATERIAL_NAMES.index("asphalt")]]),
        cell=30.0,
        origin=np.array([-15.0, -30.0]),
    )
    ROBOT.enter(replace(open_world(), ground=halves))
    for _ in range(20):
        ROBOT.step((0.5, 0.5))
    braking = [ROBOT.step((0.0, 0.0)) for _ in range(4)]
    assert max(m.twist[2] for m in braking) > 0.01


def test_a_wet_day_is_slippery_for_everything() -> None:
    world = open_world(slope_degrees=15)
    wet = replace(world, ground=replace(world.ground, friction_scale=0.25))  # mu 0.2 < tan 15
    assert abs(drive(world, (0, 0), 20)[-1].twist[0]) < 1e-3
    assert drive(wet, (0, 0), 20)[-1].twist[0] < -0.3


# --- steps, sills, ridges ------------------------------------------------------------------------


@pytest.mark.parametrize("yaw", [0.0, 0.3])
@pytest.mark.parametrize("length", [0.10, 0.20])
def test_a_sill_of_60_mm_is_passed(length: float, yaw: float) -> None:
    motions = drive(open_world(slabs=box(1.0, 0, (length, 3.0, 0.06), yaw)), (0.4, 0.4), 60)
    assert motions[-1].T_world_base[0, 3] > 1.8
    assert abs(height(motions[-1])) < 1e-3
    assert max(height(m) for m in motions) > 0.02


def test_a_step_of_90_mm_is_climbed_and_left_again() -> None:
    motions = drive(open_world(slabs=box(2.0, 0, (2.0, 3.0, 0.09))), (0.4, 0.4), 100)
    on_top = [m for m in motions if 1.4 < m.T_world_base[0, 3] < 2.6]
    assert len(on_top) > 5
    assert all(height(m) == pytest.approx(0.09, abs=0.005) for m in on_top)
    assert motions[-1].T_world_base[0, 3] > 3.4 and abs(height(motions[-1])) < 1e-3


def test_a_step_throws_nobody_up() -> None:
    """It is climbed by the tracks' own pull: the body is never lifted faster than it drives."""
    motions = drive(open_world(slabs=box(2.0, 0, (2.0, 3.0, 0.09))), (0.4, 0.4), 50)
    heights = np.concatenate([m.path[1:, 2] for m in motions])
    assert np.abs(np.diff(heights)).max() * 240 < 0.4
    assert heights.max() < 0.10


def test_a_step_is_climbed_from_gravel_but_not_from_ice() -> None:
    """At a crawl, that is: with a run-up the robot's own momentum lifts its front onto it."""
    motions = drive(open_world("ice", slabs=box(2.0, 0, (2.0, 3.0, 0.09))), (0.1, 0.1), 150)
    assert motions[-1].T_world_base[0, 3] < 0.8
    motions = drive(open_world("gravel", slabs=box(2.0, 0, (2.0, 3.0, 0.09))), (0.1, 0.1), 150)
    assert motions[-1].T_world_base[0, 3] > 1.3


def test_overlapping_slabs_are_as_high_as_the_highest() -> None:
    stairs = join(box(2.0, 0, (2.0, 3.0, 0.05)), box(2.4, 0, (1.2, 3.0, 0.10)))
    motions = drive(open_world(slabs=stairs), (0.4, 0.4), 75)
    assert max(height(m) for m in motions) == pytest.approx(0.10, abs=0.005)


def test_a_robot_gets_stuck_with_its_belly_on_a_ridge() -> None:
    """A bank between the tracks, higher than the hull is above the ground; where it ends, the
    robot gets its tracks on the ground again."""
    heights = np.zeros((7, 101))
    heights[2:5, :60] = 0.16
    bank = Ground(heights, np.zeros((6, 100), np.int64), 0.10, np.array([-5.0, -0.3]))
    world = replace(open_world(), ground=bank)
    start, *motions = drive(world, (0.4, 0.4), 50)
    assert height(start) > 0.02
    assert motions[-1].T_world_base[0, 3] - start.T_world_base[0, 3] < 0.3
    assert np.mean(longitudinal_slip(motions[-1], GAUGE)) > 0.8
    beyond = replace(world, start=np.array([1.5, 0.0, 0.0]))
    assert drive(beyond, (0.4, 0.4), 50)[-1].T_world_base[0, 3] > 3.0


# --- standing ------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", world_names())
def test_the_robot_enters_every_world_standing(name: str) -> None:
    for seed in range(5):
        world = make_world(name, np.random.default_rng(seed), difficulty=1.0)
        motion = ROBOT.enter(world)
        assert np.abs(motion.twist).max() < 0.02
        np.testing.assert_allclose(motion.T_world_base[:2, 3], world.start[:2], atol=0.03)
        x, y, heading = between(world.start, project(motion.T_world_base))
        assert abs(heading) < 0.05
        above = height(motion) - world.ground.height(motion.T_world_base[:2, 3])
        assert -0.05 < above < 0.12  # 0.12: on a slab


def test_a_robot_enters_tilted_as_the_slope_is() -> None:
    motion = ROBOT.enter(open_world(slope_degrees=12, heading=0.7))
    up = [-np.sin(np.radians(12)), 0, np.cos(np.radians(12))]
    np.testing.assert_allclose(motion.T_world_base[:3, 2], up, atol=0.01)
    assert motion.path.shape == (25, 7)


def test_the_surface_is_the_ground_or_a_slab_with_bevelled_edges() -> None:
    """Nowhere does it jump: a step would lift a patch in no time."""
    world = open_world(slope_degrees=10, slabs=box(0.0, 0.0, (1.0, 1.0, 0.3), yaw=0.5))
    surface = Surface.of(world, MATERIALS)
    x = np.linspace(-1.5, 1.5, 6001)
    heights = heights_at(surface, np.column_stack([x, np.full_like(x, 0.1)]))
    ground = world.ground.height(np.column_stack([x, np.full_like(x, 0.1)]))
    assert heights.max() == pytest.approx(0.3) and np.all(heights >= ground - 1e-12)
    assert np.abs(np.diff(heights)).max() < 4 * 5e-4


def heights_at(surface: Surface, points: Array) -> Array:
    from grouser.envs.simulation.standing import _heights

    return _heights(surface, points)


# --- centres of rotation -------------------------------------------------------------------------


@pytest.mark.parametrize("command", [(0.5, 0.2), (0.35, 0.45), (-0.2, 0.3), (0.1, -0.4)])
@pytest.mark.parametrize("material", ["gravel", "mud"])
def test_the_icrs_and_the_track_speeds_give_back_the_motion(
    material: str, command: tuple[float, float]
) -> None:
    """Within 1 % of the way over 20 s, as the issue asks; acceleration included."""
    start, *motions = drive(open_world(material), command, 200)
    pose, distance, turned, true_turned = project(start.T_world_base), 0.0, 0.0, 0.0
    before = pose
    for motion in motions:
        left, right, along = instantaneous_centres(motion)
        rate = np.diff(motion.track_speed)[0] / (left - right)
        twist = [motion.track_speed[0] + rate * left, -rate * along, rate]
        pose = compose(pose, exp(0.1 * np.array(twist)))
        after = project(motion.T_world_base)
        distance += float(np.linalg.norm(after[:2] - before[:2]))
        turned += 0.1 * rate
        true_turned += float(between(before, after)[2])
        before = after
    assert np.linalg.norm(pose[:2] - before[:2]) < 0.01 * distance
    assert turned == pytest.approx(true_turned, rel=0.01)
