"""A view from behind and above the robot, for people."""

import math

import numpy as np
from numpy.typing import NDArray

from grouser.envs.simulation.materials import TEXTURES
from grouser.envs.simulation.raycast import RayCaster
from grouser.envs.simulation.renderers.boxes import oriented_box_faces
from grouser.envs.simulation.renderers.faces import Faces
from grouser.envs.simulation.renderers.mesh import world_mesh
from grouser.envs.simulation.renderers.pinhole import Pinhole
from grouser.envs.simulation.renderers.rasteriser import Rasteriser
from grouser.envs.simulation.renderers.textures import texture_bank
from grouser.envs.simulation.robot import RobotModel
from grouser.envs.simulation.world import Light, World
from grouser.geometry import Array, lift, project
from grouser.rig import camera_mount

_MOUNT = camera_mount(-1.6, 0.0, 1.15, pitch=math.radians(24))
_TOP = np.array([0.0, 0.0, 0.5])  # of the robot: the view keeps this in sight
_ROBOT_OBJECT = -1  # none of the world's
_MARGIN = 0.85  # of the way to what would stand in the view
_FIELD_OF_VIEW = math.radians(70)


class ChaseView:
    """Draws a world with the robot in it, in colour, 4:3."""

    def __init__(self, world: World, model: RobotModel, *, width: int = 640) -> None:
        self._mesh, self._model = world_mesh(world), model
        self._caster = RayCaster(world)
        self._camera = Pinhole.with_field_of_view(width, width * 3 // 4, _FIELD_OF_VIEW)

    def frame(self, T_world_base: Array) -> NDArray[np.uint8]:
        """A new RGB image (height, width, 3) of the robot at a pose (4, 4)."""
        robot = robot_faces(self._model, T_world_base, self._mesh.light)
        mesh = self._mesh.with_faces(robot)
        return Rasteriser(mesh, self._camera, texture_bank(color=True)).render(
            self._viewpoint(T_world_base)
        )

    def _viewpoint(self, T_world_base: Array) -> Array:
        """Level behind the robot, or as near to it as obstacles and walls make it come."""
        T_world_camera = lift(project(T_world_base)) @ _MOUNT
        T_world_camera[2, 3] += T_world_base[2, 3]
        top = T_world_base[:3, 3] + _TOP
        away = T_world_camera[:3, 3] - top
        distance = float(np.linalg.norm(away))
        free = self._caster.cast(top, away[None] / distance, distance)[0]
        if free < distance:
            T_world_camera[:3, 3] = top + _MARGIN * free / distance * away
        return T_world_camera


def robot_faces(model: RobotModel, T_world_base: Array, light: Light) -> Faces:
    """The robot at a pose (4, 4), made of boxes: hull, two tracks, camera mast and lidar."""
    parts = [*_tracks(model), *_hull_and_sensors(model)]
    centre, half_extents = (np.array([part[k] for part in parts]) for k in (0, 1))
    R = T_world_base[:3, :3]
    return oriented_box_faces(
        centre @ R.T + T_world_base[:3, 3],
        half_extents,
        np.broadcast_to(R, (len(parts), 3, 3)),
        np.array([TEXTURES.index(part[2]) for part in parts]),
        light,
        objects=np.full(len(parts), _ROBOT_OBJECT),
        paint=np.array([part[3] for part in parts]),
    )


_Part = tuple[tuple[float, float, float], tuple[float, float, float], str, float]
"""Centre and half extents in the robot frame, m; texture; brightness."""


def _tracks(model: RobotModel) -> list[_Part]:
    """Each track as two slabs, of which the lower is as long as what touches the ground."""
    tracks, middle, top = model.tracks, 0.06, model.hull_bottom + 0.05
    slabs = [(0.0, middle, tracks.contact_length), (middle, top, tracks.contact_length + 0.13)]
    return [
        (
            (0, side * tracks.gauge / 2, (low + high) / 2),
            (length / 2, tracks.width / 2, (high - low) / 2),
            "blocks",
            0.4,
        )
        for side in (1, -1)
        for low, high, length in slabs
    ]


def _hull_and_sensors(model: RobotModel) -> list[_Part]:
    """The hull between the tracks, the mast with the two cameras, and the lidar on its post."""
    between = (model.tracks.gauge - model.tracks.width) / 2
    return [
        ((0, 0, 0.15), (model.length / 2, between, 0.07), "plaster", 1.0),
        ((0.20, 0, 0.31), (0.015, 0.015, 0.09), "concrete", 0.6),
        ((0.20, 0, 0.40), (0.02, 0.09, 0.02), "plaster", 0.5),
        ((0, 0, 0.32), (0.015, 0.015, 0.10), "concrete", 0.6),
        ((0, 0, 0.45), (0.045, 0.045, 0.03), "plaster", 0.3),
    ]
