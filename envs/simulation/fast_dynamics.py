"""The same law on a rigid body of our own: one call a control step, some ten times faster."""

import math
from typing import Any

import numpy as np

from grouser.envs.simulation.dynamics import LOOK_EVERY, PHYSICS_DT, Dynamics, PhysicalState
from grouser.envs.simulation.fast_body import move
from grouser.envs.simulation.hull_contacts import Obstacles, hull_wrench, obstacles_around
from grouser.envs.simulation.materials import MATERIALS, Material
from grouser.envs.simulation.robot_model import RobotModel
from grouser.envs.simulation.surface import Surface, look_around
from grouser.envs.simulation.track_law import Law, ground_wrench, rotation_of
from grouser.envs.simulation.world import World
from grouser.geometry import Array
from grouser.kernels import kernel_using


class FastDynamics(Dynamics):
    """Forces from the track law, penalty contacts and rigid-body motion in one kernel."""

    def __init__(self, model: RobotModel, materials: tuple[Material, ...] = MATERIALS) -> None:
        self._law, self._materials = Law.of(model), materials
        self._response = -math.expm1(-PHYSICS_DT / model.motor_lag)
        centre, half = model.hull
        centre = centre - [0.0, 0.0, model.com_height]
        self._body = model.mass, np.array(model.inertia), centre, half

    def load(self, world: World) -> None:
        self._surface = Surface.of(world, self._materials)
        self._obstacles = Obstacles.of(world)
        counts = len(world.slabs), len(world.solids), len(world.cylinders)
        self._nearby = tuple(np.zeros(n, np.int64) for n in counts)

    def advance(
        self, state: PhysicalState, commanded_speed: Array, traction: Array, history: Array,
        travel: Array,
    ) -> tuple[int, bool]:  # fmt: skip
        contacts, collision = _advance(
            state.body, state.track_speed, state.shear, commanded_speed, traction, self._law,
            self._surface, self._obstacles, *self._nearby, *self._body, self._response,
            PHYSICS_DT, history, travel,
        )  # fmt: skip
        return contacts, collision


@kernel_using(look_around, obstacles_around, rotation_of, ground_wrench, hull_wrench, move)
def _advance(
    body: Any, track_speed: Any, shear: Any, commanded_speed: Any, traction: Any,
    law: Any, surface: Any, obstacles: Any, slabs: Any, boxes: Any, cylinders: Any, mass: float,
    inertia: Any, centre: Any, half: Any, response: float, dt: float, history: Any, travel: Any,
) -> Any:  # fmt: skip
    wrench, R, touched = np.empty(6), np.empty((3, 3)), np.empty((law.points.shape[0], 9))
    n_slabs, top, n_boxes, n_cylinders = 0, 0.0, 0, 0
    contacts, collision = 0, False
    history[0] = body
    for k in range(history.shape[0] - 1):
        if k % LOOK_EVERY == 0:
            x, y, reach = body[0], body[1], law.reach
            n_slabs, top = look_around(surface, x, y, reach, slabs)
            n_boxes, n_cylinders = obstacles_around(obstacles, x, y, reach, boxes, cylinders)
        for side in range(2):
            track_speed[side] += response * (commanded_speed[side] - track_speed[side])
            travel[side] += dt * track_speed[side]
        rotation_of(body, R)
        ground_wrench(
            body, R, track_speed, traction, law, surface, slabs, n_slabs, top, dt, shear,
            touched, wrench,
        )  # fmt: skip
        contacts = hull_wrench(
            body, R, mass, centre, half, obstacles, boxes, n_boxes, cylinders, n_cylinders, wrench
        )
        collision = collision or contacts > 0
        move(body, R, wrench, mass, inertia, dt)
        history[k + 1] = body
    return contacts, collision
