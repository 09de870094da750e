"""What most would write for a tracked robot in PyBullet: the rival of `benchmark_environment`.

Four cylinder wheels a side with velocity motors, two images from the built-in TinyRenderer, and a
lidar by `rayTestBatch`, in the same world and with the same textures. It is measured, not offered:
the wheels turn as Bullet's friction happens to have it, and the images shimmer.
"""

import math
import tempfile
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from grouser.envs.simulation.bullet import pybullet
from grouser.envs.simulation.materials import TEXTURES
from grouser.envs.simulation.renderers.boxes import FACES_A_BOX, box_faces
from grouser.envs.simulation.renderers.level_ground import level_ground_faces
from grouser.envs.simulation.renderers.textures import texture_bank
from grouser.envs.simulation.robot import PHYSICS_DT, RobotModel
from grouser.envs.simulation.tracks import GRAVITY
from grouser.envs.simulation.world import Boxes, World
from grouser.geometry import Array, inverse_transform, lift
from grouser.rig import Rig

_WHEELS_A_SIDE = 4
_WHEEL_RADIUS = 0.09
_WHEEL_MASS = 1.0
_MOTOR_TORQUE = 60.0  # N m
_FRICTION = 0.8
_NEAR, _FAR = 0.05, 60.0
_POSITIVE = 8  # tiles: TinyRenderer repeats a texture towards positive coordinates only


class NaiveStack:
    """A robot in a world, with a lidar scan and wheel increments every step, and a pair of images.

    Args:
        images: whether there is a pair of images.
    """

    def __init__(self, world: World, rig: Rig, model: RobotModel, *, images: bool = True) -> None:
        assert rig.stereo is not None and rig.lidar is not None
        self._images = images
        self._stereo, self._lidar, self._model = rig.stereo, rig.lidar, model
        self._n_substeps = round(rig.dt / PHYSICS_DT)
        self._client = pybullet.connect(pybullet.DIRECT)
        pybullet.setGravity(0, 0, -GRAVITY, physicsClientId=self._client)
        pybullet.setTimeStep(PHYSICS_DT, physicsClientId=self._client)
        self._add_world(world)
        self._body, self._joints = self._add_robot(world.start)
        self._projection = _projection_matrix(rig)
        to_right = np.eye(4)
        to_right[0, 3] = rig.stereo.baseline
        self._mounts = [rig.stereo.T_base_camera, rig.stereo.T_base_camera @ to_right]

    def step(self, action: NDArray[np.float32]) -> dict[str, NDArray[Any]]:
        """Drive for one control step with the speeds (2,) as fractions of the top speed."""
        wheel_rate = self._model.top_speed * action / _WHEEL_RADIUS
        before = self._wheel_angles()
        pybullet.setJointMotorControlArray(
            self._body,
            self._joints,
            pybullet.VELOCITY_CONTROL,
            targetVelocities=np.repeat(wheel_rate, _WHEELS_A_SIDE).tolist(),
            forces=[_MOTOR_TORQUE] * len(self._joints),
            physicsClientId=self._client,
        )
        for _ in range(self._n_substeps):
            pybullet.stepSimulation(physicsClientId=self._client)
        turned = (self._wheel_angles() - before).reshape(2, _WHEELS_A_SIDE).mean(axis=1)
        T_world_base = self._pose()
        observation = {
            "lidar": self._scan(T_world_base @ self._lidar.T_base_lidar),
            "tracks": turned * _WHEEL_RADIUS,
        }
        if self._images:
            eyes = (self._image(T_world_base @ mount) for mount in self._mounts)
            observation |= dict(zip(("left", "right"), eyes, strict=True))
        return observation

    def close(self) -> None:
        """Free the physics."""
        pybullet.disconnect(physicsClientId=self._client)

    def _wheel_angles(self) -> Array:
        states = pybullet.getJointStates(self._body, self._joints, physicsClientId=self._client)
        return np.array([state[0] for state in states])

    def _pose(self) -> Array:
        position, quaternion = pybullet.getBasePositionAndOrientation(
            self._body, physicsClientId=self._client
        )
        T = np.eye(4)
        T[:3, :3] = np.reshape(pybullet.getMatrixFromQuaternion(quaternion), (3, 3))
        T[:3, 3] = position - _WHEEL_RADIUS * T[:3, 2]
        return T

    def _image(self, T_world_camera: Array) -> NDArray[np.uint8]:
        T_optical_gl = np.diag([1.0, -1.0, -1.0, 1.0])
        view = T_optical_gl @ inverse_transform(T_world_camera)
        _, _, rgba, _, _ = pybullet.getCameraImage(
            self._stereo.width,
            self._stereo.height,
            view.T.ravel().tolist(),
            self._projection,
            renderer=pybullet.ER_TINY_RENDERER,
            physicsClientId=self._client,
        )
        rgb = np.reshape(rgba, (self._stereo.height, self._stereo.width, 4))[..., :3]
        return np.asarray(cv2.cvtColor(rgb.astype(np.uint8), cv2.COLOR_RGB2GRAY))

    def _scan(self, T_world_lidar: Array) -> NDArray[np.float32]:
        bearing, reach = self._lidar.bearings, self._lidar.range_max
        beams = np.column_stack([np.cos(bearing), np.sin(bearing), np.zeros(len(bearing))])
        start = T_world_lidar[:3, 3]
        ends = start + reach * beams @ T_world_lidar[:3, :3].T
        hits = pybullet.rayTestBatch(
            [start.tolist()] * len(bearing), ends.tolist(), physicsClientId=self._client
        )
        return np.array([reach * hit[2] for hit in hits], dtype=np.float32)

    def _add_world(self, world: World) -> None:
        """The ground and every solid, each with the very faces that our own renderer shows."""
        textures, ground, half = self._load_textures(), world.ground, world.ground.cell / 2
        floor = level_ground_faces(ground, world.light, beyond=0.0)
        self._add_box(
            Boxes(
                np.array([[0, 0, -0.5]]),
                np.array([[half, half, 0.5]]),
                np.zeros(1),
                ground.textures[ground.material[0]],
            ),
            0,
            (floor.corners, floor.uv),
            textures,
        )
        faces = box_faces(world.solids, world.light, first_object=0)
        for i in range(len(world.solids)):
            part = slice(FACES_A_BOX * i, FACES_A_BOX * (i + 1))
            self._add_box(world.solids, i, (faces.corners[part], faces.uv[part]), textures)

    def _add_box(
        self, boxes: Boxes, i: int, faces: tuple[Array, Array], textures: list[int]
    ) -> None:
        c, centre, half, yaw = self._client, boxes.centre[i], boxes.half_extents[i], boxes.yaw[i]
        body = pybullet.createMultiBody(
            0,
            pybullet.createCollisionShape(
                pybullet.GEOM_BOX, halfExtents=half.tolist(), physicsClientId=c
            ),
            self._visual(lift([*centre[:2], yaw])[:3, :3], centre, *faces),
            centre.tolist(),
            [0, 0, math.sin(yaw / 2), math.cos(yaw / 2)],
            physicsClientId=c,
        )
        texture = textures[boxes.texture[i]]
        pybullet.changeVisualShape(body, -1, textureUniqueId=texture, physicsClientId=c)
        pybullet.changeDynamics(body, -1, lateralFriction=1.0, physicsClientId=c)

    def _visual(self, R_world_box: Array, centre: Array, corners: Array, uv: Array) -> int:
        """A mesh of faces (n, 4, 3), so that a texture repeats as often as it should."""
        vertices = (corners.reshape(-1, 3) - centre) @ R_world_box
        triangles = 4 * np.arange(len(corners))[:, None] + [0, 1, 2, 0, 2, 3]
        edges = np.cross(corners[:, 1] - corners[:, 0], corners[:, 3] - corners[:, 0])
        normals = edges / np.linalg.norm(edges, axis=1, keepdims=True) @ R_world_box
        shape = pybullet.createVisualShape(
            pybullet.GEOM_MESH,
            vertices=vertices.tolist(),
            indices=triangles.ravel().tolist(),
            uvs=(uv.reshape(-1, 2) + _POSITIVE).tolist(),
            normals=np.repeat(normals, 4, axis=0).tolist(),
            physicsClientId=self._client,
        )
        return int(shape)

    def _load_textures(self) -> list[int]:
        bank = texture_bank(False)
        with tempfile.TemporaryDirectory() as folder:
            ids = []
            for i, name in enumerate(TEXTURES):
                path = Path(folder) / f"{name}.png"
                cv2.imwrite(str(path), bank.level(i, 0))
                ids.append(int(pybullet.loadTexture(str(path), physicsClientId=self._client)))
        return ids

    def _add_robot(self, start: Array) -> tuple[int, list[int]]:
        c, model = self._client, self._model
        x = np.linspace(-0.5, 0.5, _WHEELS_A_SIDE) * model.tracks.contact_length
        positions = [[xi, side * model.tracks.gauge / 2, 0] for side in (1, -1) for xi in x]
        hull = pybullet.createCollisionShape(
            pybullet.GEOM_BOX,
            halfExtents=[model.length / 2, 0.15, 0.05],
            collisionFramePosition=[0, 0, 0.06],
            physicsClientId=c,
        )
        wheel = pybullet.createCollisionShape(
            pybullet.GEOM_CYLINDER,
            radius=_WHEEL_RADIUS,
            height=model.tracks.width,
            collisionFrameOrientation=pybullet.getQuaternionFromEuler([math.pi / 2, 0, 0]),
            physicsClientId=c,
        )
        n = len(positions)
        body = pybullet.createMultiBody(
            model.mass - n * _WHEEL_MASS,
            hull,
            -1,
            [start[0], start[1], _WHEEL_RADIUS],
            [0, 0, math.sin(start[2] / 2), math.cos(start[2] / 2)],
            linkMasses=[_WHEEL_MASS] * n,
            linkCollisionShapeIndices=[wheel] * n,
            linkVisualShapeIndices=[-1] * n,
            linkPositions=positions,
            linkOrientations=[[0, 0, 0, 1]] * n,
            linkInertialFramePositions=[[0, 0, 0]] * n,
            linkInertialFrameOrientations=[[0, 0, 0, 1]] * n,
            linkParentIndices=[0] * n,
            linkJointTypes=[pybullet.JOINT_REVOLUTE] * n,
            linkJointAxis=[[0, 1, 0]] * n,
            physicsClientId=c,
        )
        for joint in range(n):
            pybullet.changeDynamics(body, joint, lateralFriction=_FRICTION, physicsClientId=c)
        return int(body), list(range(n))


def _projection_matrix(rig: Rig) -> list[float]:
    """OpenGL's, column by column, for the rig's left camera."""
    stereo = rig.stereo
    assert stereo is not None
    P = np.zeros((4, 4))
    P[0, 0], P[1, 1] = 2 * stereo.fx / stereo.width, 2 * stereo.fy / stereo.height
    P[2, 2], P[2, 3] = -(_FAR + _NEAR) / (_FAR - _NEAR), -2 * _FAR * _NEAR / (_FAR - _NEAR)
    P[3, 2] = -1
    return [float(value) for value in P.T.ravel()]
