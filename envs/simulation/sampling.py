"""The colour of every pixel: textures under trilinear and anisotropic filtering, weighted by cover.

Deferred: a pixel that shows one face is textured once, however many sub-samples it has; one on an
edge, once for each face on it, at the centroid of the sub-samples that see it.
"""

import math
from typing import Any

import numpy as np

from grouser.envs.simulation.kernels import inlined, kernel

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
    channels = image.shape[2]
    colour = np.empty(channels, dtype=np.float32)
    for y in range(height):
        for x in range(width):
            colour[:] = _ZERO
            for s in range(n_samples):
                count, cx, cy = _share(faces, subsamples, s, y, x)
                if count == 0:
                    continue
                weight, i = F(count) / F(n_samples), faces[s, y, x]
                if i < 0:
                    for q in range(channels):
                        colour[q] += weight * sky[q]
                else:
                    k = texture[i]
                    size = sizes[k]
                    u, v, step_u, step_v, taps, level, blend = _footprint(
                        planes[i], F(x) + cx, F(y) + cy, size, anisotropy
                    )
                    gain = weight * shade[i] / F(taps)
                    for q in range(channels):
                        value = _filtered(
                            texels, offsets[k, level], size >> level, channels, q,
                            u, v, step_u, step_v, taps,
                        )  # fmt: skip
                        if blend > F(1 / 64):
                            coarse = _filtered(
                                texels, offsets[k, level + 1], size >> (level + 1), channels, q,
                                u, v, step_u, step_v, taps,
                            )  # fmt: skip
                            value += blend * (coarse - value)
                        colour[q] += gain * value
                if count == n_samples:
                    break
            for q in range(channels):
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


@inlined
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
    zn = z * n
    ux, uy = (p[3] - un * p[0]) * zn, (p[4] - un * p[1]) * zn  # texels a pixel, exact
    vx, vy = (p[7] - vn * p[0]) * zn, (p[8] - vn * p[1]) * zn
    across, down = ux * ux + vx * vx, uy * uy + vy * vy
    longer: Any = math.sqrt(max(across, down))
    step_u, step_v = _ZERO, _ZERO
    taps = 1
    if anisotropy > 1 and longer > _ONE:
        shorter: Any = math.sqrt(min(across, down))
        taps = min(anisotropy, max(1, int(longer / max(shorter, _ONE) + F(0.95))))
        if taps > 1:
            spread = _ONE / (n * F(taps)) * min(_ONE, n / longer)  # at most one tile
            step_u, step_v = (ux, vx) if across > down else (uy, vy)
            step_u *= spread
            step_v *= spread
    width = min(longer / F(taps), F(size // 2))
    level = 0
    while width >= _TWO:
        width *= _HALF
        level += 1
    u, v = un + p[6], vn + p[10]
    blend = min(max(width - _ONE, _ZERO), _ONE)
    return u - np.floor(u), v - np.floor(v), step_u, step_v, taps, level, blend


@inlined
def _filtered(
    texels: Any, offset: int, n: int, channels: int, channel: int,
    u: Any, v: Any, step_u: Any, step_v: Any, taps: int,
) -> Any:  # fmt: skip
    """Sum of the taps' bilinear samples of one channel of one mip level of side n."""
    size, total = F(n), _ZERO
    away = _HALF * F(1 - taps)
    for _ in range(taps):
        # One tile further, so that conversion to an integer rounds down.
        a = (u + away * step_u + _ONE) * size - _HALF
        b = (v + away * step_v + _ONE) * size - _HALF
        away += _ONE
        ia, ib = int(a), int(b)
        fa, fb = a - F(ia), b - F(ib)
        left, right = (ia & (n - 1)) * channels + channel, ((ia + 1) & (n - 1)) * channels + channel
        upper, lower = (
            offset + (ib & (n - 1)) * n * channels,
            offset + ((ib + 1) & (n - 1)) * n * channels,
        )
        t0, b0 = F(texels[upper + left]), F(texels[lower + left])
        top = t0 + fa * (F(texels[upper + right]) - t0)
        bottom = b0 + fa * (F(texels[lower + right]) - b0)
        total += top + fb * (bottom - top)
    return total
