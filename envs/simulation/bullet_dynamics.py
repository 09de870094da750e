"""The body in Bullet, which keeps it out of boxes, walls and trunks.

The ground carries it through the law of `track_law.py` alone, since Bullet has no contact surface
that moves.

Bullet remembers its contacts from one physics step to the next, and nothing brings that memory back
bit by bit. So every control step begins without it: pose and velocity are written anew, and the
body is taken out of the collision pairs and put back. What the body does then depends on those
thirteen numbers alone, and they can be saved.
"""

import math
import weakref
from typing import Any

import numpy as np

from grouser.envs.simulation.bullet import pybullet
from grouser.envs.simulation.dynamics import LOOK_EVERY, PHYSICS_DT, Dynamics, PhysicalState
from grouser.envs.simulation.materials import MATERIALS, Material
from grouser.envs.simulation.robot_model import RobotModel
from grouser.envs.simulation.surface import Surface, look_around
from grouser.envs.simulation.track_law import Law, ground_wrench, rotation_of
from grouser.envs.simulation.tracks import GRAVITY
from grouser.envs.simulation.world import Boxes, Cylinders, World
from grouser.geometry import Array

_MOVING, _STATIC = 1, 2
"""Bullet's collision groups: bodies without mass are in the second."""
_MOST_SHAPES = 16
"""Bullet's limit for one body."""


class BulletWorld:
    """A private Bullet client holding one world and one body; `close` frees it, and so does
    forgetting it: a client takes 20 MB."""

    def __init__(self, model: RobotModel) -> None:
        self._model = model
        self.client = pybullet.connect(pybullet.DIRECT)
        self._free = weakref.finalize(self, pybullet.disconnect, physicsClientId=self.client)
        self.body = -1

    def load(self, world: World) -> None:
        """Forget everything and put the world's solids and the robot's body into it."""
        c = self.client
        pybullet.resetSimulation(physicsClientId=c)
        pybullet.setGravity(0, 0, -GRAVITY, physicsClientId=c)
        pybullet.setPhysicsEngineParameter(
            fixedTimeStep=PHYSICS_DT, numSubSteps=1, deterministicOverlappingPairs=1,
            physicsClientId=c,
        )  # fmt: skip
        self._add_obstacles(world)
        self.body = self._add_body()

    def write(self, state: Array) -> None:
        """Put the body into a state (13,), with no memory of what it touched."""
        c = self.client
        pybullet.resetBasePositionAndOrientation(
            self.body, state[0:3], state[3:7], physicsClientId=c
        )
        pybullet.resetBaseVelocity(self.body, state[7:10], state[10:13], physicsClientId=c)
        pybullet.setCollisionFilterGroupMask(self.body, -1, _MOVING, _STATIC, physicsClientId=c)

    def read(self, state: Array) -> None:
        """Write the body's state into state (13,), laid out as `ground_wrench` says."""
        c = self.client
        state[0:3], state[3:7] = pybullet.getBasePositionAndOrientation(
            self.body, physicsClientId=c
        )
        state[7:10], state[10:13] = pybullet.getBaseVelocity(self.body, physicsClientId=c)

    def step(self, wrench: Array, position: Array) -> int:
        """One physics step under a wrench (6,) at the centre of mass; the contact points after."""
        c, world = self.client, pybullet.WORLD_FRAME
        pybullet.applyExternalForce(self.body, -1, wrench[:3], position, world, physicsClientId=c)
        pybullet.applyExternalTorque(self.body, -1, wrench[3:], world, physicsClientId=c)
        pybullet.stepSimulation(physicsClientId=c)
        return len(pybullet.getContactPoints(bodyA=self.body, physicsClientId=c))

    def close(self) -> None:
        """Free the client; a second call does nothing."""
        self._free()
        self.client = -1  # the number may be another's soon

    def _add_obstacles(self, world: World) -> None:
        """As few bodies as hold them all: every one costs time in every physics step.

        Without a picture of its own, each of them would be given one, which takes ten times as long
        as all the rest.
        """
        picture = pybullet.createVisualShape(
            pybullet.GEOM_BOX, halfExtents=[1e-3] * 3, physicsClientId=self.client
        )
        shapes = [*_box_shapes(world.solids), *_cylinder_shapes(world.cylinders)]
        for first in range(0, len(shapes), _MOST_SHAPES):
            types, radii, halves, lengths, places, turns = (
                list(column) for column in zip(*shapes[first : first + _MOST_SHAPES], strict=True)
            )
            shape = pybullet.createCollisionShapeArray(
                shapeTypes=types, radii=radii, halfExtents=halves, lengths=lengths,
                collisionFramePositions=places, collisionFrameOrientations=turns,
                physicsClientId=self.client,
            )  # fmt: skip
            pybullet.createMultiBody(
                0, shape, picture, useMaximalCoordinates=1, physicsClientId=self.client
            )

    def _add_body(self) -> int:
        c, model = self.client, self._model
        centre, half = model.hull
        shape = pybullet.createCollisionShape(
            pybullet.GEOM_BOX, halfExtents=half.tolist(),
            collisionFramePosition=(centre - [0, 0, model.com_height]).tolist(), physicsClientId=c,
        )  # fmt: skip
        body = pybullet.createMultiBody(model.mass, shape, -1, [0, 0, 1], physicsClientId=c)
        pybullet.changeDynamics(
            body, -1, localInertiaDiagonal=list(model.inertia), lateralFriction=0.3, restitution=0,
            linearDamping=0, angularDamping=0, physicsClientId=c,
        )  # fmt: skip
        return int(body)


_Shape = tuple[int, float, list[float], float, list[float], list[float]]
"""Bullet's kind, radius, half extents, length, position and quaternion; those it has no use for
are ignored."""


def _box_shapes(boxes: Boxes) -> list[_Shape]:
    columns = (boxes.half_extents.tolist(), boxes.centre.tolist(), boxes.yaw.tolist())
    return [
        (pybullet.GEOM_BOX, 0.0, half, 0.0, centre, [0, 0, math.sin(yaw / 2), math.cos(yaw / 2)])
        for half, centre, yaw in zip(*columns, strict=True)
    ]


def _cylinder_shapes(cylinders: Cylinders) -> list[_Shape]:
    columns = (cylinders.radius, 2 * cylinders.half_height, cylinders.centre)
    return [
        (pybullet.GEOM_CYLINDER, radius, [0.0] * 3, length, centre, [0.0, 0.0, 0.0, 1.0])
        for radius, length, centre in zip(*(column.tolist() for column in columns), strict=True)
    ]


class BulletDynamics(Dynamics):
    """Forces from the track law on a body in Bullet."""

    def __init__(self, model: RobotModel, materials: tuple[Material, ...] = MATERIALS) -> None:
        self.bullet = BulletWorld(model)
        self._law, self._materials = Law.of(model), materials
        self._response = -math.expm1(-PHYSICS_DT / model.motor_lag)
        self._wrench, self._R = np.zeros(6), np.zeros((3, 3))
        self._touched = np.empty((len(self._law.points), 9))

    def load(self, world: World) -> None:
        self.bullet.load(world)
        self._surface = Surface.of(world, self._materials)
        self._nearby = np.zeros(len(world.slabs), np.int64)

    def advance(
        self, state: PhysicalState, commanded_speed: Array, traction: Array, history: Array,
        travel: Array,
    ) -> tuple[int, bool]:  # fmt: skip
        bullet, wrench = self.bullet, self._wrench
        contacts, collision = 0, False
        bullet.write(state.body)
        history[0] = state.body
        seen: Any = ()
        for k in range(len(history) - 1):
            if k % LOOK_EVERY == 0:
                x, y = history[k, :2]
                seen = look_around(self._surface, x, y, self._law.reach, self._nearby)
            state.track_speed[:] += self._response * (commanded_speed - state.track_speed)
            travel += PHYSICS_DT * state.track_speed
            rotation_of(history[k], self._R)
            ground_wrench(
                history[k], self._R, state.track_speed, traction, self._law, self._surface,
                self._nearby, *seen, PHYSICS_DT, state.shear, self._touched, wrench,
            )  # fmt: skip
            contacts = bullet.step(wrench, history[k, :3])
            collision = collision or contacts > 0
            bullet.read(history[k + 1])
        state.body[:] = history[-1]
        return contacts, collision

    def close(self) -> None:
        self.bullet.close()
