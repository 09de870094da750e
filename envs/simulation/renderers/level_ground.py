"""The faces of level ground: few large rectangles, whatever the number of its cells; and the level
ground beyond the edge of any."""

import numpy as np
from numpy.typing import NDArray

from grouser.envs.simulation.ground import Ground
from grouser.envs.simulation.renderers.faces import Faces, brightness, make_faces
from grouser.envs.simulation.world import Light
from grouser.geometry import Array

BEYOND = 60.0
"""How far ground is drawn beyond the edge of its grid, m."""

GROUND_OBJECT = 1
_UNDER = 0.005  # m


def level_ground_faces(ground: Ground, light: Light, *, beyond: float = BEYOND) -> Faces:
    """One face a rectangle of cells that look alike; those at the edge go on beyond it [m]."""
    looks = ground.textures[ground.material]
    blocks = rectangles(looks)
    rows, columns = looks.shape
    low = ground.origin + ground.cell * blocks[:, [1, 0]]
    high = ground.origin + ground.cell * blocks[:, [3, 2]]
    low = low - beyond * (blocks[:, [1, 0]] == 0)
    high = high + beyond * (blocks[:, [3, 2]] == [columns, rows])
    x = np.stack([low[:, 0], high[:, 0], high[:, 0], low[:, 0]], axis=-1)
    y = np.stack([low[:, 1], low[:, 1], high[:, 1], high[:, 1]], axis=-1)
    corners = np.stack([x, y, np.zeros_like(x)], axis=-1)
    shown = looks[blocks[:, 0], blocks[:, 1]]
    if len(blocks) > 1:
        corners, shown = np.concatenate([corners, _underlay(corners)]), np.append(shown, shown[:1])
    return ground_faces(corners, shown, light)


def _underlay(corners: Array) -> Array:
    """(1, 4, 3) one rectangle under all others: where a corner of one lies on a side of another,
    rounding may leave a crack between them."""
    (x0, y0, _), (x1, y1, _) = corners.min(axis=(0, 1)), corners.max(axis=(0, 1))
    return np.array([[[x0, y0, -_UNDER], [x1, y0, -_UNDER], [x1, y1, -_UNDER], [x0, y1, -_UNDER]]])


def beyond_faces(ground: Ground, light: Light) -> Faces:
    """What goes on beyond the edge of uneven ground, level across the edge: a ring of long cells
    around its own."""
    heights, looks = np.pad(ground.heights, 1, "edge"), np.pad(ground.material, 1, "edge")
    rows, columns = looks.shape
    x, y = (
        origin + ground.cell * np.arange(-1.0, n)
        for origin, n in zip(ground.origin, (columns, rows), strict=True)
    )
    for along in (x, y):
        along[0], along[-1] = along[1] - BEYOND, along[-2] + BEYOND
    ring = np.ones(looks.shape, dtype=bool)
    ring[1:-1, 1:-1] = False
    r, c = np.nonzero(ring)
    r_corners = np.stack([r, r, r + 1, r + 1], axis=-1)
    c_corners = np.stack([c, c + 1, c + 1, c], axis=-1)
    corners = np.stack([x[c_corners], y[r_corners], heights[r_corners, c_corners]], axis=-1)
    return ground_faces(corners, ground.textures[looks[r, c]], light)


def ground_faces(corners: Array, texture: NDArray[np.int64], light: Light) -> Faces:
    """Faces of ground, textured from above so that they continue one another."""
    edges = np.cross(corners[:, 1] - corners[:, 0], corners[:, 3] - corners[:, 0])
    lit = brightness(light, edges / np.linalg.norm(edges, axis=-1, keepdims=True))
    n = len(texture)
    return make_faces(
        corners,
        corners[..., :2],
        texture,
        shade=np.repeat(lit[:, None], 4, axis=1),
        object=np.full(n, GROUND_OBJECT),
        surface=texture,
        chunk=np.arange(n),
    )


def rectangles(looks: NDArray[np.int64]) -> NDArray[np.int64]:
    """(n, 4) first row, first column, end row, end column of blocks of equal values that together
    cover an array: runs along rows, joined with the same run of the row before."""
    blocks: list[list[int]] = []
    open_runs: dict[tuple[int, int, int], list[int]] = {}
    for r, row in enumerate(looks):
        cuts = [0, *(np.flatnonzero(np.diff(row)) + 1).tolist(), len(row)]
        runs = {}
        for begin, end in zip(cuts[:-1], cuts[1:], strict=True):
            key = (begin, end, int(row[begin]))
            block = open_runs.get(key, [r, begin, r, end])
            if key not in open_runs:
                blocks.append(block)
            block[2] = r + 1
            runs[key] = block
        open_runs = runs
    return np.array(blocks, dtype=np.int64)
