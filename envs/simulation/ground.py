"""The ground: heights on a grid and a material in every cell.

Each cell is two flat triangles, split from its lower left to its upper right corner. Tracks, lidar
and cameras all take it for just that, so they agree to rounding.
"""

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from grouser.envs.simulation.materials import MATERIALS, TEXTURES, material_index
from grouser.frozen import freeze, rebuilt
from grouser.geometry import Array
from grouser.kernels import kernel


def _own_textures() -> NDArray[np.int64]:
    return np.array([TEXTURES.index(material.texture) for material in MATERIALS])


@dataclass(frozen=True, slots=True, eq=False)
class Ground:
    """Heights at the nodes of a grid; beyond its edge the ground goes on level."""

    heights: Array
    """(rows + 1, columns + 1) m; a row is one y, a column one x."""
    material: NDArray[np.int64]
    """(rows, columns) of the cells, indices into MATERIALS."""
    cell: float
    """Side of a cell, m."""
    origin: Array
    """(2,) x and y of heights[0, 0], m."""
    friction_scale: float = 1.0
    """Every material's friction is multiplied by this: a wet day, worn shoes."""
    textures: NDArray[np.int64] = field(default_factory=_own_textures)
    """(material,) what each looks like, indices into materials.TEXTURES."""

    def __post_init__(self) -> None:
        rows, columns = self.material.shape
        if self.heights.shape != (rows + 1, columns + 1):
            raise ValueError(
                f"heights are at the nodes of {rows} x {columns} cells and must have shape "
                f"{(rows + 1, columns + 1)}, got {self.heights.shape}"
            )
        freeze(self)

    def __reduce__(self) -> tuple[Any, ...]:
        return rebuilt(self)

    @staticmethod
    def flat(half_size: float, material: str = "gravel") -> "Ground":
        """A level square of one material around the world's origin, in one cell."""
        return Ground(
            heights=np.zeros((2, 2)),
            material=np.full((1, 1), material_index(material)),
            cell=2 * half_size,
            origin=np.full(2, -half_size),
        )

    def made_of(self, material: str) -> "Ground":
        """The same heights with one material everywhere."""
        return replace(self, material=np.full_like(self.material, material_index(material)))

    @property
    def is_level(self) -> bool:
        """Whether all heights are zero."""
        return not np.any(self.heights)

    def height(self, xy: ArrayLike) -> Array:
        """(...) m at points (..., 2)."""
        return self._at(xy)[..., 0]

    def normal(self, xy: ArrayLike) -> Array:
        """(..., 3) unit normals at points (..., 2)."""
        found = self._at(xy)
        up = np.concatenate([-found[..., 1:3], np.ones_like(found[..., :1])], axis=-1)
        return np.asarray(up / np.linalg.norm(up, axis=-1, keepdims=True))

    def material_at(self, xy: ArrayLike) -> NDArray[np.int64]:
        """(...) indices into MATERIALS at points (..., 2)."""
        found = self._at(xy)[..., 3:].astype(np.int64)
        return np.asarray(self.material[found[..., 0], found[..., 1]])

    def _at(self, xy: ArrayLike) -> Array:
        points = np.asarray(xy, dtype=np.float64)
        flat = points.reshape(-1, 2)
        out = np.empty((len(flat), 5))
        _ground_at_points(self.heights, self.cell, self.origin, flat, out)
        return out.reshape(*points.shape[:-1], 5)


@kernel
def ground_at(heights: Any, cell: float, origin: Any, x: float, y: float) -> Any:
    """Height [m], slope along x and y, row and column of the cell at a point."""
    rows, columns = heights.shape[0] - 1, heights.shape[1] - 1
    u = min(max((x - origin[0]) / cell, 0.0), float(columns))
    v = min(max((y - origin[1]) / cell, 0.0), float(rows))
    column, row = min(int(u), columns - 1), min(int(v), rows - 1)
    a, b = u - column, v - row
    h00, h11 = heights[row, column], heights[row + 1, column + 1]
    if a >= b:
        along_x, along_y = heights[row, column + 1] - h00, h11 - heights[row, column + 1]
    else:
        along_x, along_y = h11 - heights[row + 1, column], heights[row + 1, column] - h00
    return h00 + a * along_x + b * along_y, along_x / cell, along_y / cell, row, column


@kernel
def _ground_at_points(heights: Any, cell: float, origin: Any, points: Any, out: Any) -> None:
    for k in range(points.shape[0]):
        h, sx, sy, row, column = ground_at(heights, cell, origin, points[k, 0], points[k, 1])
        out[k, 0], out[k, 1], out[k, 2], out[k, 3], out[k, 4] = h, sx, sy, row, column
