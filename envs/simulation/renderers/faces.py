"""Textured flat faces as renderers take them, in chunks that are out of sight together."""

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from grouser.envs.simulation.renderers.textures import texture_metres
from grouser.envs.simulation.world import Light
from grouser.geometry import Array


@dataclass(frozen=True, slots=True, eq=False)
class Faces:
    """n parallelograms, or flat pieces of one: counter-clockwise seen from the side that shows."""

    corners: Array
    """(n, 4, 3) m, in the world frame; the last two may coincide."""
    uv: Array
    """(n, 4, 2) texture coordinates of the corners, in tiles; affine on the face."""
    shade: NDArray[np.float32]
    """(n, 3) brightness by the light: a + b u + c v."""
    texture: NDArray[np.int32]
    """(n,) indices into materials.TEXTURES."""
    object: NDArray[np.int32]
    """(n,) what `Renderer.segmentation` shows."""
    surface: NDArray[np.int32]
    """(n,) faces of one surface continue one another: no edge shows between them."""
    chunk: NDArray[np.int32]
    """(n,) whose faces stand together, numbered from 0 in order; for culling."""

    def __len__(self) -> int:
        return len(self.texture)


def make_faces(
    corners: Array,
    uv: Array,
    texture: NDArray[np.integer],
    *,
    shade: Array,
    object: NDArray[np.integer],
    surface: NDArray[np.integer],
    chunk: NDArray[np.integer],
) -> Faces:
    """Faces as kernels want them.

    Args:
        corners, texture, object, surface, chunk: as in Faces.
        uv: (n, 4, 2) place on the face, m.
        shade: (n, 4) brightness at the corners, affine on the face.
    """
    tiles = uv / texture_metres()[texture][:, None, None]
    return Faces(
        np.ascontiguousarray(corners, dtype=np.float64),
        np.ascontiguousarray(tiles),
        affine_shade(tiles, shade),
        *(np.ascontiguousarray(a, dtype=np.int32) for a in (texture, object, surface, chunk)),
    )


def affine_shade(uv: Array, shade: Array) -> NDArray[np.float32]:
    """(n, 3) coefficients of the shade in u and v, from corners 0, 1 and 3."""
    a, b = uv[:, 1] - uv[:, 0], uv[:, 3] - uv[:, 0]
    along_a, along_b = shade[:, 1] - shade[:, 0], shade[:, 3] - shade[:, 0]
    determinant = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
    gu = (b[:, 1] * along_a - a[:, 1] * along_b) / determinant
    gv = (a[:, 0] * along_b - b[:, 0] * along_a) / determinant
    constant = shade[:, 0] - gu * uv[:, 0, 0] - gv * uv[:, 0, 1]
    return np.stack([constant, gu, gv], axis=-1).astype(np.float32)


def join_faces(*parts: Faces) -> Faces:
    """The faces of all parts, in order; surfaces and chunks of different parts stay apart."""
    joined = {f.name: [getattr(part, f.name) for part in parts] for f in fields(Faces)}
    for name in ("surface", "chunk"):
        sizes = [int(part.max(initial=-1)) + 1 for part in joined[name]]
        firsts = np.cumsum([0, *sizes[:-1]]).astype(np.int32)
        joined[name] = [a + first for a, first in zip(joined[name], firsts, strict=True)]
    return Faces(**{name: np.concatenate(arrays) for name, arrays in joined.items()})


def brightness(light: Light, normals: Array) -> Array:
    """(...) ambient plus Lambert's cosine law, at unit normals (..., 3)."""
    return np.asarray(light.ambient + light.direct * np.clip(normals @ light.direction, 0, 1))


def decorrelating_offsets(n: int) -> Array:
    """(n, 1, 2) shifts of the texture, m, so that no two faces show the same pattern at a
    corner."""
    steps = np.array([0.7548776662466927, 0.5698402909980532])  # the R2 low-discrepancy sequence
    return np.asarray(2 * np.mod(np.arange(1, n + 1)[:, None, None] * steps, 1.0))
