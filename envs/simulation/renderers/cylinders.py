"""The faces of upright cylinders: as many flat sides as roundness needs, with smooth light."""

import math

import numpy as np
from numpy.typing import NDArray

from grouser.envs.simulation.renderers.faces import (
    Faces,
    brightness,
    decorrelating_offsets,
    join_faces,
    make_faces,
)
from grouser.envs.simulation.world import Cylinders, Light
from grouser.geometry import Array

_WORST = 0.08 * 2.0 / 246.0
"""Largest error of a side, m: 0.08 px, seen from 2 m by 320 px over 66 degrees; aside in the
picture, where it shows larger, less than 0.1 px."""


def cylinder_faces(cylinders: Cylinders, light: Light, first_object: int) -> Faces:
    """Sides and both caps; the cylinders are objects first_object, first_object + 1 ..."""
    sides = np.array([number_of_sides(r) for r in cylinders.radius.tolist()], dtype=np.int64)
    objects = first_object + np.arange(len(cylinders))
    alike = [np.flatnonzero(sides == n) for n in np.unique(sides)]
    return join_faces(
        *(
            part
            for k in alike
            for part in (
                _sides(cylinders, k, int(sides[k[0]]), light, objects[k]),
                _caps(cylinders, k, int(sides[k[0]]), light, objects[k]),
            )
        ),
    )


def number_of_sides(radius: float) -> int:
    """An even number of sides, of which the silhouette errs by less than _WORST either way.

    The sides cut the circle, half of the deviation r (1 - cos(pi / n)) without, half within.
    """
    n = math.pi / math.acos(max(1 - 2 * _WORST / radius, 0.0))
    return max(6, 2 * math.ceil(n / 2))


def _ring(cylinders: Cylinders, k: NDArray[np.int64], n: int) -> Array:
    """(len(k), n, 2) corners around the axis, m, counter-clockwise."""
    angle = 2 * np.pi * np.arange(n) / n
    circle = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    radius = 2 * cylinders.radius[k] / (1 + math.cos(math.pi / n))
    return np.asarray(cylinders.centre[k, None, :2] + radius[:, None, None] * circle)


def _sides(
    cylinders: Cylinders, k: NDArray[np.int64], n: int, light: Light, objects: NDArray[np.int64]
) -> Faces:
    m = len(k)
    ring = _ring(cylinders, k, n)
    following = np.roll(ring, -1, axis=1)
    around = np.stack([ring, following, following, ring], axis=2)
    low, high = (cylinders.centre[k, 2] + s * cylinders.half_height[k] for s in (-1, 1))
    up = np.stack([low, low, high, high], axis=-1)[:, None].repeat(n, axis=1)
    angle = 2 * np.pi * np.arange(n + 1) / n
    normals = np.stack([np.cos(angle), np.sin(angle), np.zeros(n + 1)], axis=-1)
    lit = brightness(light, normals)
    arc = np.stack([angle[:-1], angle[1:], angle[1:], angle[:-1]], axis=-1)
    uv = np.stack([cylinders.radius[k][:, None, None] * arc, up], axis=-1)
    uv = uv + decorrelating_offsets(m)[:, :, None]
    shade = np.stack([lit[:-1], lit[1:], lit[1:], lit[:-1]], axis=-1)
    return make_faces(
        np.concatenate([around, up[..., None]], axis=-1).reshape(m * n, 4, 3),
        uv.reshape(m * n, 4, 2),
        np.repeat(cylinders.texture[k], n),
        shade=np.tile(shade, (m, 1)),
        object=np.repeat(objects, n),
        surface=np.repeat(np.arange(m), n),
        chunk=np.repeat(np.arange(m), n),
    )


def _caps(
    cylinders: Cylinders, k: NDArray[np.int64], n: int, light: Light, objects: NDArray[np.int64]
) -> Faces:
    """The top, and the underside, as fans of quadrilaterals."""
    m, first = len(k), np.arange(1, n - 1, 2)
    fan = np.stack([np.zeros_like(first), first, first + 1, first + 2], axis=-1) % n
    parts = []
    for sign, turn in ((1, fan), (-1, fan[:, ::-1])):
        z = cylinders.centre[k, 2] + sign * cylinders.half_height[k]
        xy = _ring(cylinders, k, n)[:, turn].reshape(-1, 4, 2)
        up = np.repeat(z, len(fan))[:, None, None].repeat(4, axis=1)
        lit = float(brightness(light, np.array([0.0, 0.0, sign])))
        parts.append(
            make_faces(
                np.concatenate([xy, up], axis=-1),
                xy * [1, sign],
                np.repeat(cylinders.texture[k], len(fan)),
                shade=np.full(xy.shape[:2], lit),
                object=np.repeat(objects, len(fan)),
                surface=np.repeat(np.arange(m), len(fan)),
                chunk=np.repeat(np.arange(m), len(fan)),
            )
        )
    return join_faces(*parts)
