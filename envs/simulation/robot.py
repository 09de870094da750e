"""The robot in Bullet: one rigid body, driven by the forces of its tracks.

Bullet moves the body and keeps it out of boxes and walls; the ground carries it through the tracks
alone (`tracks.py`), since Bullet has no contact surface that moves.
"""

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from grouser.envs.simulation.bullet import pybullet
from grouser.envs.simulation.motion import Motion, motion_from_history
from grouser.envs.simulation.tracks import GRAVITY, TrackModel, track_wrench
from grouser.envs.simulation.world import Boxes, World
from grouser.geometry import Array

PHYSICS_DT = 1 / 240
"""Length of a physics step, s."""

_SETTLING_STEPS = 60


@dataclass(frozen=True, slots=True)
class RobotModel:
    """A small tracked robot of the size of a Husky's little brother."""

    mass: float = 40.0
    """kg"""
    length: float = 0.60
    """m, of the hull, which alone collides with boxes and walls."""
    hull_width: float = 0.48
    """m, over the tracks."""
    hull_bottom: float = 0.12
    """m above the ground at rest; lower things pass under the hull."""
    hull_top: float = 0.22
    com_height: float = 0.086
    """Centre of mass above the robot's origin, which lies on the ground at rest, m."""
    inertia: tuple[float, float, float] = (0.81, 1.33, 1.88)
    """About the centre of mass, kg m^2: a block of 0.60 x 0.45 x 0.20 m."""
    top_speed: float = 0.5
    """Of a track, m/s."""
    motor_lag: float = 0.1
    """Time constant with which a track follows its command, s."""
    tracks: TrackModel = field(default_factory=TrackModel)

    @property
    def hull(self) -> tuple[Array, Array]:
        """Centre and half extents (3,) of the hull, robot frame, m."""
        top, bottom = self.hull_top, self.hull_bottom
        centre = np.array([0, 0, (top + bottom) / 2])
        return centre, np.array([self.length, self.hull_width, top - bottom]) / 2


class BulletWorld:
    """A private Bullet client holding one world and one body; `close` frees it."""

    def __init__(self, model: RobotModel) -> None:
        self._model = model
        self.client = pybullet.connect(pybullet.DIRECT)
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
        self._add_boxes(world.solids)
        self.body = self._add_body()

    def place(self, x: float, y: float, heading: float) -> None:
        """Put the body at rest at a pose on the ground."""
        height = self._model.com_height
        pybullet.resetBasePositionAndOrientation(
            self.body, [x, y, height], [0, 0, math.sin(heading / 2), math.cos(heading / 2)],
            physicsClientId=self.client,
        )  # fmt: skip

    def read(self, state: Array) -> None:
        """Write the body's state into state (13,), laid out as `track_wrench` says."""
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
        if self.client >= 0:
            pybullet.disconnect(physicsClientId=self.client)
            self.client = -1

    def _add_boxes(self, boxes: Boxes) -> None:
        c = self.client
        for centre, half, yaw in zip(boxes.centre, boxes.half_extents, boxes.yaw, strict=True):
            shape = pybullet.createCollisionShape(
                pybullet.GEOM_BOX, halfExtents=half.tolist(), physicsClientId=c
            )
            turned = [0, 0, math.sin(yaw / 2), math.cos(yaw / 2)]
            pybullet.createMultiBody(0, shape, -1, centre.tolist(), turned, physicsClientId=c)

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


class TrackedRobot:
    """The robot with its tracks and motors in a Bullet world of its own.

    Args:
        model: its body and tracks.
        dt: length of a control step, s: a multiple of PHYSICS_DT.
    """

    def __init__(self, model: RobotModel, *, dt: float) -> None:
        self.model = model
        self._n_substeps = _substeps(dt)
        self._bullet = BulletWorld(model)
        self._law = _kernel_arguments(model)
        self._speed, self._wrench = np.zeros(2), np.zeros(6)
        self._shear = np.zeros((2, len(self._law[0]), 2))
        self._response = -math.expm1(-PHYSICS_DT / model.motor_lag)

    def enter(self, world: World) -> Motion:
        """Stand at the start of a world, settled on the ground; what a sensor feels there."""
        self._bullet.load(world)
        self._bullet.place(*world.start)
        self._speed[:], self._shear[:] = 0.0, 0.0
        return self._run(np.zeros(2), _SETTLING_STEPS)

    def step(self, commanded_speed: Array) -> Motion:
        """Drive one control step with a speed (2,) commanded to the left and right track, m/s."""
        return self._run(commanded_speed, self._n_substeps)

    def close(self) -> None:
        """Free the physics."""
        self._bullet.close()

    def _run(self, commanded_speed: Array, n: int) -> Motion:
        history, travel, contacts, collision = np.empty((n + 1, 13)), np.zeros(2), 0, False
        self._bullet.read(history[0])
        for k in range(n):
            self._speed += self._response * (commanded_speed - self._speed)
            travel += PHYSICS_DT * self._speed
            track_wrench(history[k], self._speed, *self._law, self._shear, self._wrench)
            contacts = self._bullet.step(self._wrench, history[k, :3])
            collision = collision or contacts > 0
            self._bullet.read(history[k + 1])
        return motion_from_history(
            history, travel, com_height=self.model.com_height, dt=PHYSICS_DT,
            contacts=contacts, collision=collision,
        )  # fmt: skip


def _substeps(dt: float) -> int:
    n = round(dt / PHYSICS_DT)
    if n < 1 or abs(n * PHYSICS_DT - dt) > 1e-9:
        raise ValueError(
            f"a control step of {dt} s is no multiple of the physics step of 1/240 s; "
            f"the nearest that is: {max(n, 1) / 240:.6g} s"
        )
    return n


def _kernel_arguments(model: RobotModel) -> tuple[Any, ...]:
    """What `track_wrench` takes between the speeds and the shear."""
    tracks = model.tracks
    x, above = tracks.patches()
    sole = -model.com_height - tracks.sinkage
    spacing = tracks.contact_length / (tracks.n_patches - 1)
    spring, damper = tracks.ground_stiffness(model.mass)
    return (
        x, above + sole, tracks.gauge / 2, tracks.friction, tracks.shear_modulus, spring, damper,
        spacing, PHYSICS_DT,
    )  # fmt: skip
