"""Uneven ground as renderers take it: its nodes, the light on them, and chunks of cells."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from grouser.envs.simulation.ground import Ground
from grouser.envs.simulation.renderers.faces import brightness
from grouser.envs.simulation.world import Light
from grouser.geometry import Array

CELLS_A_CHUNK = 8
"""Side of a chunk, cells: what is culled at once."""


class Relief(NamedTuple):
    """A heightfield, as kernels take it. Level ground has one without cells."""

    heights: Array
    """(rows + 1, columns + 1) m."""
    shade: Array
    """(rows + 1, columns + 1) brightness at the nodes."""
    texture: NDArray[np.int32]
    """(rows, columns) of the cells."""
    cell: float
    """m"""
    origin: Array
    """(2,) x and y of heights[0, 0], m."""
    lowest: Array
    """(chunk rows, chunk columns) m."""
    highest: Array
    """(chunk rows, chunk columns) m."""


def relief_of(ground: Ground, light: Light) -> Relief:
    """The relief of uneven ground; one without cells where it is level."""
    if ground.is_level:
        nothing = np.zeros((0, 0))
        return Relief(
            np.zeros((1, 1)), np.zeros((1, 1)), nothing.astype(np.int32), ground.cell,
            ground.origin, nothing, nothing,
        )  # fmt: skip
    rows, columns = ground.material.shape
    chunked = (
        np.arange(0, rows, CELLS_A_CHUNK)[:, None, None, None],
        np.arange(0, columns, CELLS_A_CHUNK)[None, :, None, None],
    )
    within = np.arange(CELLS_A_CHUNK + 1)
    nodes = ground.heights[
        np.minimum(chunked[0] + within[:, None], rows),
        np.minimum(chunked[1] + within[None, :], columns),
    ]
    return Relief(
        heights=ground.heights,
        shade=brightness(light, node_normals(ground)),
        texture=ground.textures[ground.material].astype(np.int32),
        cell=ground.cell,
        origin=ground.origin,
        lowest=nodes.min(axis=(2, 3)),
        highest=nodes.max(axis=(2, 3)),
    )


def node_normals(ground: Ground) -> Array:
    """(rows + 1, columns + 1, 3) unit normals at the nodes, by central differences."""
    along_y, along_x = np.gradient(ground.heights, ground.cell)
    normals = np.stack([-along_x, -along_y, np.ones_like(along_x)], axis=-1)
    return np.asarray(normals / np.linalg.norm(normals, axis=-1, keepdims=True))
