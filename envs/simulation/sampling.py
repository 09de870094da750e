"""The colour of every pixel: textures under trilinear and anisotropic filtering, weighted by cover.

Deferred: a pixel that shows one face is textured once, however many sub-samples it has; one on an
edge, once for each face on it, at the centroid of the sub-samples that see it.
"""

import math
from typing import Any

import numpy as np

from grouser.envs.simulation.kernels import kernel

F = np.float32
_ZERO, _HALF, _ONE, _TWO = F(0), F(0.5), F(1), F(2)


@kernel
def resolve(
    planes: Any,
    texture: Any,
    shade: Any,
    faces: Any,
    subsamples: Any,
    texels: Any,
    offsets: Any,
    sizes: Any,
    anisotropy: int,
    sky: Any,
    image: Any,
) -> None:
    """Colour an image.

    Args:
        planes: (F, N_PLANES) float32, from `project_faces`.
        texture, shade: (F,) of the faces.
        faces: (S, height, width), from `cover`.
        subsamples: (S, 2) float32 of SUBSAMPLES.
        texels, offsets, sizes: of a `TextureBank`.
        anisotropy: most samples along a footprint's longer axis.
        sky: (channels,) float32.
        image: out, (height, width, channels) uint8.
    """
    n_samples, height, width = faces.shape
    colour = np.empty(image.shape[2], dtype=np.float32)
    for y in range(height):
        for x in range(width):
            colour[:] = _ZERO
            for s in range(n_samples):
                count, cx, cy = _share(faces, subsamples, s, y, x)
                if count == 0:
                    continue
                weight, i = F(count) / F(n_samples), faces[s, y, x]
                if i < 0:
                    for q in range(colour.shape[0]):
                        colour[q] += weight * sky[q]
                else:
                    k = texture[i]
                    _add_texture(
                        planes[i], F(x) + cx, F(y) + cy, texels, offsets[k], sizes[k], anisotropy,
                        weight * shade[i], colour,
                    )  # fmt: skip
                if count == n_samples:
                    break
            for q in range(colour.shape[0]):
                image[y, x, q] = np.uint8(min(max(colour[q] + _HALF, _ZERO), F(255)))


@kernel
def _share(faces: Any, subsamples: Any, s: int, y: int, x: int) -> Any:
    """Sub-samples that see the face of sub-sample s, and their centroid; none if told before."""
    i = faces[s, y, x]
    for r in range(s):
        if faces[r, y, x] == i:
            return 0, _ZERO, _ZERO
    count, cx, cy = 0, _ZERO, _ZERO
    for r in range(s, faces.shape[0]):
        if faces[r, y, x] == i:
            count += 1
            cx += subsamples[r, 0]
            cy += subsamples[r, 1]
    return count, cx / F(count), cy / F(count)


@kernel
def _add_texture(
    p: Any, x: Any, y: Any, texels: Any, offsets: Any, size: int, anisotropy: int, weight: Any,
    colour: Any,
) -> None:  # fmt: skip
    """Add weight times the filtered texture at pixel (x, y) of a face to the colour."""
    u, v, step_u, step_v, taps, level, blend = _footprint(p, x, y, size, anisotropy)
    _add_level(texels, offsets[level], size >> level, u, v, step_u, step_v, taps,
               weight * (_ONE - blend) / F(taps), colour)  # fmt: skip
    if blend > F(1 / 64):
        _add_level(texels, offsets[level + 1], size >> (level + 1), u, v, step_u, step_v, taps,
                   weight * blend / F(taps), colour)  # fmt: skip


@kernel
def _footprint(p: Any, x: Any, y: Any, size: int, anisotropy: int) -> Any:
    """Where a pixel lies on its texture, and how it is to be filtered.

    Returns:
        u, v in [0, 1); the step between taps along the footprint's longer axis; the number of
        taps; the finer of the two mip levels, and the weight of the coarser.
    """
    n = F(size)
    z = _ONE / (p[0] * x + p[1] * y + p[2])
    un = (p[3] * x + p[4] * y + p[5]) * z
    vn = (p[7] * x + p[8] * y + p[9]) * z
    ux, uy = (p[3] - un * p[0]) * z * n, (p[4] - un * p[1]) * z * n  # texels a pixel, exact
    vx, vy = (p[7] - vn * p[0]) * z * n, (p[8] - vn * p[1]) * z * n
    across, down = ux * ux + vx * vx, uy * uy + vy * vy
    longer: Any = math.sqrt(max(across, down))
    shorter: Any = math.sqrt(min(across, down))
    taps = 1
    if longer > _ONE:
        taps = min(anisotropy, max(1, int(longer / max(shorter, _ONE) + F(0.95))))
    step_u, step_v = (ux, vx) if across > down else (uy, vy)
    spread = _ONE / (n * F(taps)) * min(_ONE, n / longer)  # at most one tile
    width = min(longer / F(taps), F(size // 2))
    level = 0
    while width >= _TWO:
        width *= _HALF
        level += 1
    u, v = un + p[6], vn + p[10]
    blend = min(max(width - _ONE, _ZERO), _ONE)
    return (
        u - math.floor(u),
        v - math.floor(v),
        step_u * spread,
        step_v * spread,
        taps,
        level,
        blend,
    )


@kernel
def _add_level(
    texels: Any, offset: int, n: int, u: Any, v: Any, step_u: Any, step_v: Any, taps: int,
    weight: Any, colour: Any,
) -> None:  # fmt: skip
    """Add the taps' bilinear samples of one mip level of side n."""
    channels, size = colour.shape[0], F(n)
    away = _HALF * F(1 - taps)
    for _ in range(taps):
        # One tile further, so that conversion to an integer rounds down.
        a = (u + away * step_u + _ONE) * size - _HALF
        b = (v + away * step_v + _ONE) * size - _HALF
        away += _ONE
        ia, ib = int(a), int(b)
        fa, fb = a - F(ia), b - F(ib)
        left, right = ia & (n - 1), (ia + 1) & (n - 1)
        upper, lower = (
            offset + (ib & (n - 1)) * n * channels,
            offset + ((ib + 1) & (n - 1)) * n * channels,
        )
        for q in range(channels):
            t0, t1 = F(texels[upper + left * channels + q]), F(texels[upper + right * channels + q])
            b0, b1 = F(texels[lower + left * channels + q]), F(texels[lower + right * channels + q])
            top, bottom = t0 + fa * (t1 - t0), b0 + fa * (b1 - b0)
            colour[q] += weight * (top + fb * (bottom - top))
