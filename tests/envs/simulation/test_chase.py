"""The chase view keeps the robot in sight, wherever it stands."""

from dataclasses import replace

import numpy as np
import pytest

from grouser.envs.simulation.chase import ChaseView, robot_faces
from grouser.envs.simulation.robot import RobotModel
from grouser.envs.simulation.worlds.registry import make_world
from grouser.geometry import lift

WORLD = make_world("yard", np.random.default_rng(0))


@pytest.mark.parametrize(
    "pose", [(0.0, 0.0, 0.0), (-8.6, 0.0, 0.0), (8.6, 3.0, np.pi), (0.0, -8.6, np.pi / 2)]
)
def test_the_camera_stays_inside_the_walls(pose: tuple[float, float, float]) -> None:
    viewpoint = ChaseView(WORLD, RobotModel())._viewpoint(lift(pose))
    assert np.abs(viewpoint[:2, 3]).max() < 9.0
    behind = (viewpoint[:2, 3] - pose[:2]) @ [np.cos(pose[2]), np.sin(pose[2])]
    assert behind < 0


def test_the_camera_climbs_with_the_robot() -> None:
    view, level = ChaseView(WORLD, RobotModel()), lift(WORLD.start)
    raised = level.copy()
    raised[2, 3] += 0.7
    np.testing.assert_allclose(
        view._viewpoint(raised)[:3, 3] - view._viewpoint(level)[:3, 3], [0, 0, 0.7], atol=1e-12
    )


def test_a_robot_with_its_back_to_a_wall_is_seen() -> None:
    """Its picture differs from one of the same place without it."""
    pose = lift([-8.6, 0.0, 0.0])
    view = ChaseView(WORLD, RobotModel(), width=160)
    empty = replace(RobotModel(), length=0.002, hull_width=0.002)
    with_robot, without = view.frame(pose), ChaseView(WORLD, empty, width=160).frame(pose)
    assert with_robot.shape == (120, 160, 3)
    assert np.any(with_robot != without, axis=-1).mean() > 0.01


def test_the_robot_is_as_large_as_its_model_says() -> None:
    model = RobotModel()
    corners = robot_faces(model, lift([0.0, 0.0, 0.0]), WORLD.light).corners.reshape(-1, 3)
    x, y, z = np.abs(corners).max(axis=0)
    assert x == pytest.approx(model.length / 2, abs=0.02)
    assert y == pytest.approx(model.hull_width / 2)
    assert 0.4 < z < 0.6 and corners[:, 2].min() == pytest.approx(0.0)
