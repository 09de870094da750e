"""What a world looks like: faces, relief and sky."""

from dataclasses import dataclass, replace

import numpy as np

from grouser.envs.simulation.renderers.boxes import box_faces
from grouser.envs.simulation.renderers.cylinders import cylinder_faces
from grouser.envs.simulation.renderers.faces import Faces, join_faces
from grouser.envs.simulation.renderers.level_ground import (
    GROUND_OBJECT,
    beyond_faces,
    level_ground_faces,
)
from grouser.envs.simulation.renderers.relief import Relief, relief_of
from grouser.envs.simulation.world import Light, World
from grouser.geometry import Array

SKY_OBJECT = 0


@dataclass(frozen=True, slots=True, eq=False)
class Mesh:
    """Everything that shows, in a fixed light."""

    faces: Faces
    relief: Relief
    light: Light

    def chunks(self) -> Array:
        """(n, 6) of the faces: first, one past the last, and a sphere around them, m."""
        chunk, corners = self.faces.chunk, self.faces.corners
        first = np.flatnonzero(np.diff(chunk, prepend=-1))
        end = np.append(first[1:], len(chunk))
        low = np.minimum.reduceat(corners.min(axis=1), first, axis=0)
        high = np.maximum.reduceat(corners.max(axis=1), first, axis=0)
        radius = np.linalg.norm(high - low, axis=-1) / 2
        return np.column_stack([first, end, (low + high) / 2, radius * (1 + 1e-9)])

    def with_faces(self, more: Faces) -> "Mesh":
        """The same with more faces."""
        return replace(self, faces=join_faces(self.faces, more))


def world_mesh(world: World) -> Mesh:
    """The ground and what stands on it. Objects are numbered as `Renderer.segmentation` says."""
    light = world.light
    first = GROUND_OBJECT + 1 + np.cumsum([0, len(world.solids), len(world.cylinders)])
    ground = level_ground_faces if world.ground.is_level else beyond_faces
    return Mesh(
        faces=join_faces(
            ground(world.ground, light),
            box_faces(world.solids, light, first[0]),
            *([cylinder_faces(world.cylinders, light, first[1])] if len(world.cylinders) else []),
            box_faces(world.slabs, light, first[2]),
        ),
        relief=relief_of(world.ground, light),
        light=light,
    )
