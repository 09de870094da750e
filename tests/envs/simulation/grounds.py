"""Small worlds for tests of the physics."""

from dataclasses import replace

import numpy as np

from grouser.envs.simulation.ground import Ground
from grouser.envs.simulation.robot import TrackedRobot
from grouser.envs.simulation.world import Boxes, Cylinders, World
from grouser.geometry import Array

HALF_SIZE = 30.0


def open_world(
    material: str = "gravel",
    *,
    slope_degrees: float = 0.0,
    heading: float = 0.0,
    solids: Boxes | None = None,
    cylinders: Cylinders | None = None,
    slabs: Boxes | None = None,
) -> World:
    """A plane that rises along x; the robot starts in its middle."""
    ground = Ground.flat(HALF_SIZE, material)
    rise = HALF_SIZE * np.tan(np.radians(slope_degrees))
    return World(
        name="test",
        solids=solids or Boxes.none(),
        n_walls=0,
        ground=replace(ground, heights=np.tile([-rise, rise], (2, 1))),
        start=np.array([0.0, 0.0, heading]),
        clear_radius=0.0,
        cylinders=cylinders or Cylinders.none(),
        slabs=slabs or Boxes.none(),
    )


def box(x: float, y: float, size: tuple[float, float, float], yaw: float = 0.0) -> Boxes:
    """One box that stands on the ground, of a length, width and height [m]."""
    half = np.array([size]) / 2
    centre = np.array([[x, y, half[0, 2]]])
    return Boxes(centre, half, np.array([yaw]), np.zeros(1, dtype=np.int64))


def trunk(x: float, y: float, radius: float) -> Cylinders:
    """One upright cylinder, 2 m high."""
    middle = np.array([[x, y, 1.0]])
    return Cylinders(middle, np.array([radius]), np.ones(1), np.zeros(1, dtype=np.int64))


def put(
    robot: TrackedRobot,
    world: World,
    *,
    above: float = 0.0,
    rotation_vector: tuple[float, float, float] = (0, 0, 0),
    velocity: tuple[float, float, float] = (0, 0, 0),
) -> None:
    """Let the robot go so far above where it would stand, turned, and moving."""
    robot.enter(world)
    state = robot.save()
    vector = np.array(rotation_vector, dtype=np.float64)
    angle = float(np.linalg.norm(vector))
    axis = vector / angle if angle > 0 else vector
    state.body[2] += above
    state.body[3:7] = [*(np.sin(angle / 2) * axis), np.cos(angle / 2)]
    state.body[7:10] = velocity
    state.body[10:13] = 0.0
    state.shear[:] = 0.0
    robot.restore(state, world)


def mechanical_energy(robot: TrackedRobot) -> float:
    """Kinetic and potential energy of the body, J."""
    body, model = robot.save().body, robot.model
    x, y, z, w = body[3:7]
    rotation = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )
    rate: Array = body[10:13] @ rotation
    kinetic = 0.5 * model.mass * body[7:10] @ body[7:10] + 0.5 * rate**2 @ np.array(model.inertia)
    return float(kinetic + model.mass * 9.81 * body[2])
