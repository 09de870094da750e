"""From a heightfield to polygons in the image: every node is projected once, so that the triangles
around it fit together to the last bit; chunks out of view and triangles without a sample cost
almost nothing."""

import math
from typing import Any, Final

import numpy as np

from grouser.envs.simulation.renderers.level_ground import GROUND_OBJECT
from grouser.envs.simulation.renderers.projection import (
    faces_camera,
    meets_samples,
    project_polygon,
    sphere_in_view,
    to_camera,
    write_planes,
)
from grouser.envs.simulation.renderers.relief import CELLS_A_CHUNK
from grouser.envs.simulation.renderers.visible import MAX_CORNERS
from grouser.kernels import kernel, kernel_using

_NODES: Final = CELLS_A_CHUNK + 1
_OBJECT: Final = GROUND_OBJECT

# The corners of a cell's two triangles, as (row, column) from its own; the last twice, as
# polygons have four. The cell is split from its lower left to its upper right corner.
_TRIANGLES: Final = np.array([[[0, 0], [0, 1], [1, 1], [1, 1]], [[0, 0], [1, 1], [1, 0], [1, 0]]])


@kernel_using(faces_camera, meets_samples, project_polygon, sphere_in_view, to_camera, write_planes)
def project_relief(relief: Any, tiles: Any, view: Any, visible: Any, n: int) -> int:
    """Append every triangle that may show to the n polygons there are; the number there are then.

    Args:
        relief: a `Relief`.
        tiles: (texture,) side of one tile, m.
        view: a `View`.
        visible: a `Visible` with room for all.
    """
    rows, columns = relief.texture.shape
    nodes, pixels = np.empty((_NODES, _NODES, 3)), np.empty((_NODES, _NODES, 2))
    triangle = np.empty((4, 3)), np.empty((4, 2)), np.empty(4), np.empty((MAX_CORNERS, 3))
    for chunk_row in range(relief.lowest.shape[0]):
        for chunk_column in range(relief.lowest.shape[1]):
            if not _chunk_in_view(relief, chunk_row, chunk_column, view):
                continue
            first_row, first_column = chunk_row * CELLS_A_CHUNK, chunk_column * CELLS_A_CHUNK
            n_rows = min(CELLS_A_CHUNK, rows - first_row)
            n_columns = min(CELLS_A_CHUNK, columns - first_column)
            _project_nodes(relief, first_row, first_column, n_rows, n_columns, view, nodes, pixels)
            for r in range(n_rows):
                for c in range(n_columns):
                    for half in range(2):
                        if _may_show(nodes, pixels, r, c, half, view):
                            n = _append(
                                relief, tiles, nodes, first_row, first_column, r, c, half, view,
                                triangle, visible, n,
                            )  # fmt: skip
    return n


@kernel_using(sphere_in_view)
def _chunk_in_view(relief: Any, chunk_row: int, chunk_column: int, view: Any) -> bool:
    low, high = relief.lowest[chunk_row, chunk_column], relief.highest[chunk_row, chunk_column]
    half = 0.5 * CELLS_A_CHUNK * relief.cell
    x = relief.origin[0] + (2 * chunk_column + 1) * half
    y = relief.origin[1] + (2 * chunk_row + 1) * half
    up = 0.5 * (high - low)
    radius = math.sqrt(2 * half * half + up * up) * (1 + 1e-9)
    return bool(sphere_in_view(x, y, 0.5 * (low + high), radius, view))


@kernel_using(to_camera)
def _project_nodes(
    relief: Any,
    first_row: int,
    first_column: int,
    n_rows: int,
    n_columns: int,
    view: Any,
    nodes: Any,
    pixels: Any,
) -> None:
    """The nodes of a chunk in the camera frame and, where that is before the camera, in pixels."""
    f = view.intrinsics
    for r in range(n_rows + 1):
        y = relief.origin[1] + (first_row + r) * relief.cell
        for c in range(n_columns + 1):
            x = relief.origin[0] + (first_column + c) * relief.cell
            p = nodes[r, c]
            to_camera(x, y, relief.heights[first_row + r, first_column + c], view, p)
            if p[2] >= view.near:
                pixels[r, c, 0] = f[0] * p[0] / p[2] + f[2]
                pixels[r, c, 1] = f[1] * p[1] / p[2] + f[3]


@kernel_using(meets_samples)
def _may_show(nodes: Any, pixels: Any, r: int, c: int, half: int, view: Any) -> bool:
    """Whether a triangle may cover a sample, told from its pixels if it lies before the camera."""
    left, right, top, bottom = np.inf, -np.inf, np.inf, -np.inf
    before = 0
    for k in range(3):
        row, column = r + _TRIANGLES[half, k, 0], c + _TRIANGLES[half, k, 1]
        if nodes[row, column, 2] >= view.near:
            before += 1
            x, y = pixels[row, column, 0], pixels[row, column, 1]
            left, right, top, bottom = min(left, x), max(right, x), min(top, y), max(bottom, y)
    if before == 3:
        return bool(meets_samples(left, right, top, bottom, view))
    return before > 0


@kernel_using(faces_camera, project_polygon, write_planes)
def _append(
    relief: Any,
    tiles: Any,
    nodes: Any,
    first_row: int,
    first_column: int,
    r: int,
    c: int,
    half: int,
    view: Any,
    triangle: Any,
    visible: Any,
    n: int,
) -> int:
    """Append one triangle if it shows. `triangle` is memory to work in: corners in the camera
    frame, texture coordinates, brightness, and corners that are clipped."""
    camera, uv, lit, clipped = triangle
    texture = relief.texture[first_row + r, first_column + c]
    for k in range(4):
        row, column = r + _TRIANGLES[half, k, 0], c + _TRIANGLES[half, k, 1]
        camera[k] = nodes[row, column]
        uv[k, 0] = (relief.origin[0] + (first_column + column) * relief.cell) / tiles[texture]
        uv[k, 1] = (relief.origin[1] + (first_row + row) * relief.cell) / tiles[texture]
        lit[k] = relief.shade[first_row + row, first_column + column]
    if not (faces_camera(camera) and project_polygon(camera, view, clipped, visible, n)):
        return n
    write_planes(camera, uv, view.intrinsics, visible, n)
    _write_shade(uv, lit, visible.shade[n])
    visible.texture[n], visible.object[n] = texture, _OBJECT
    visible.surface[n] = -1 - texture  # apart from those of faces
    return n + 1


@kernel
def _write_shade(uv: Any, lit: Any, out: Any) -> None:
    """As `affine_shade` of faces."""
    au, av, bu, bv = (
        uv[1, 0] - uv[0, 0],
        uv[1, 1] - uv[0, 1],
        uv[3, 0] - uv[0, 0],
        uv[3, 1] - uv[0, 1],
    )
    along_a, along_b = lit[1] - lit[0], lit[3] - lit[0]
    determinant = au * bv - av * bu
    gu = (bv * along_a - av * along_b) / determinant
    gv = (au * along_b - bu * along_a) / determinant
    out[0] = np.float32(lit[0] - gu * uv[0, 0] - gv * uv[0, 1])
    out[1], out[2] = np.float32(gu), np.float32(gv)
