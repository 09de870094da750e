"""The colour of every pixel: textures under trilinear and anisotropic filtering, weighted by cover.

Deferred: a pixel that shows one face is textured once, however many sub-samples it has; one on an
edge, once for each face on it, at the centroid of the sub-samples that see it. Rows are taken run
by run, a run being pixels that show one face throughout: where a run lies on its texture is
computed in a loop without branches, which the compiler turns into vector instructions.
"""

from typing import Any, Final

import numpy as np

from grouser.kernels import inlined, kernel

F, U = np.float32, np.uint32
_ZERO, _HALF, _ONE, _TWO = F(0), F(0.5), F(1), F(2)

# Rows of the buffer of footprints: texture coordinates in [0, 1), the step between two taps along
# the footprint's longer axis (in tiles), the number of taps, and the width of each in texels.
_U, _V, _STEP_U, _STEP_V, _TAPS, _WIDTH = range(6)
_N_FOOTPRINT: Final = 6


@kernel
def resolve(
    planes: Any,
    texture: Any,
    shade: Any,
    faces: Any,
    subsamples: Any,
    bank: Any,
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
        bank: a `TextureBank`.
        anisotropy: most samples along a footprint's longer axis.
        sky: (channels,) float32.
        image: out, (height, width, channels) uint8.
    """
    _, height, width = faces.shape
    footprints = np.empty((_N_FOOTPRINT, width), dtype=np.float32)
    colours = np.empty((width, bank.channels), dtype=np.float32)
    for y in range(height):
        colours[:] = _ZERO
        begin = 0
        while begin < width:
            i = faces[0, y, begin]
            end = _run_end(faces, y, begin)
            if end == begin:
                _add_edge(
                    planes, texture, shade, faces, subsamples, bank, anisotropy, sky, y, begin,
                    footprints, colours,
                )  # fmt: skip
                end = begin + 1
            elif i < 0:
                for x in range(begin, end):
                    for q in range(bank.channels):
                        colours[x, q] = sky[q]
            else:
                k = texture[i]
                _footprints(
                    planes[i], begin, end, _ZERO, F(y), F(bank.sizes[k]), F(anisotropy), footprints
                )
                for x in range(begin, end):
                    _add_texture(bank, k, footprints, x, shade[i], colours)
            begin = end
        for x in range(width):
            for q in range(bank.channels):
                image[y, x, q] = np.uint8(min(max(colours[x, q] + _HALF, _ZERO), F(255)))


@kernel
def _run_end(faces: Any, y: int, begin: int) -> int:
    """One past the last of the pixels from `begin` on that show one face with all sub-samples."""
    i, end, width = faces[0, y, begin], begin, faces.shape[2]
    while end < width:
        for s in range(faces.shape[0]):
            if faces[s, y, end] != i:
                return end
        end += 1
    return end


@kernel
def _add_edge(
    planes: Any,
    texture: Any,
    shade: Any,
    faces: Any,
    subsamples: Any,
    bank: Any,
    anisotropy: int,
    sky: Any,
    y: int,
    x: int,
    footprints: Any,
    colours: Any,
) -> None:
    """Colour one pixel that shows several faces."""
    n_samples = faces.shape[0]
    for s in range(n_samples):
        i = faces[s, y, x]
        count, dx, dy = _share(faces, subsamples, s, y, x)
        weight = F(count) / F(n_samples)
        if count > 0 and i < 0:
            for q in range(bank.channels):
                colours[x, q] += weight * sky[q]
        elif count > 0:
            k = texture[i]
            _footprints(
                planes[i], x, x + 1, dx, F(y) + dy, F(bank.sizes[k]), F(anisotropy), footprints
            )
            _add_texture(bank, k, footprints, x, weight * shade[i], colours)


@kernel
def _share(faces: Any, subsamples: Any, s: int, y: int, x: int) -> Any:
    """Sub-samples that see the face of sub-sample s, and their centroid; 0 if told before."""
    i = faces[s, y, x]
    count, dx, dy = 0, _ZERO, _ZERO
    for r in range(faces.shape[0]):
        if faces[r, y, x] == i:
            if r < s:
                return 0, _ZERO, _ZERO
            count += 1
            dx += subsamples[r, 0]
            dy += subsamples[r, 1]
    return count, dx / F(count), dy / F(count)


@kernel
def _footprints(
    p: Any, begin: int, end: int, dx: Any, y: Any, size: Any, anisotropy: Any, out: Any
) -> None:
    """Where the pixels [begin, end) of a row, sampled at x + dx and y, lie on their texture.

    Every operation is one that vector units have, and conditions are selections, not branches.
    """
    p0, p1, p3, p4, p7, p8 = p[0], p[1], p[3], p[4], p[7], p[8]
    w0, u0, v0 = p1 * y + p[2], p4 * y + p[5], p8 * y + p[9]
    u_origin, v_origin, x0, coarsest = p[6], p[10], F(begin) + dx, size * _HALF
    # Views that begin at zero: an index that may be negative would keep the loop from vectors.
    to_u, to_v = out[_U, begin:end], out[_V, begin:end]
    to_step_u, to_step_v = out[_STEP_U, begin:end], out[_STEP_V, begin:end]
    to_taps, to_width = out[_TAPS, begin:end], out[_WIDTH, begin:end]
    for k in range(to_u.size):
        x = x0 + F(np.int32(k))
        z = _ONE / (p0 * x + w0)
        u, v = (p3 * x + u0) * z, (p7 * x + v0) * z
        texels = z * size  # derivatives in texels a pixel, exact
        ux, uy = (p3 - u * p0) * texels, (p4 - u * p1) * texels
        vx, vy = (p7 - v * p0) * texels, (p8 - v * p1) * texels
        across, down = ux * ux + vx * vx, uy * uy + vy * vy
        lying = across > down
        longer = np.sqrt(across if lying else down)
        shorter = np.sqrt(down if lying else across)
        taps = F(np.int32(longer / (shorter if shorter > _ONE else _ONE) + _HALF))
        taps = taps if taps > _ONE else _ONE
        taps = taps if taps < anisotropy else anisotropy
        width = longer / taps
        # A step in tiles; the taps together reach over one tile at most.
        step = _ONE / (taps * (longer if longer > size else size))
        to_u[k], to_v[k] = _fraction(u + u_origin), _fraction(v + v_origin)
        to_step_u[k] = (ux if lying else uy) * step
        to_step_v[k] = (vx if lying else vy) * step
        to_taps[k] = taps
        to_width[k] = width if width < coarsest else coarsest


@inlined
def _fraction(x: Any) -> Any:
    """x - floor(x) in operations that vector units have."""
    whole = F(np.int32(x))
    return x - (whole if whole <= x else whole - _ONE)


@inlined
def _add_texture(
    bank: Any, texture: int, footprints: Any, x: int, weight: Any, colours: Any
) -> None:
    """Add weight times the texture under the footprint x, blended between two scales."""
    width, level = footprints[_WIDTH, x], 0
    while width >= _TWO:
        width *= _HALF
        level += 1
    blend, side = width - _ONE, bank.sizes[texture] >> level
    gain = weight / footprints[_TAPS, x]
    for q in range(bank.channels):
        fine = bank.offsets[texture, level] + q
        value = _taps(bank.texels, fine, side, bank.channels, footprints, x)
        if blend > F(1 / 64):
            coarse = bank.offsets[texture, level + 1] + q
            other = _taps(bank.texels, coarse, side >> 1, bank.channels, footprints, x)
            value += blend * (other - value)
        colours[x, q] += gain * value


@inlined
def _taps(texels: Any, offset: int, side: int, channels: int, footprints: Any, x: int) -> Any:
    """Sum of the bilinear samples along a footprint, on the level of a side at an offset."""
    # Unsigned throughout: for a signed index the compiler would see to negative ones as well.
    last, size, taps = U(side - 1), F(side), int(footprints[_TAPS, x])
    line, start, each = U(side * channels), U(offset), U(channels)
    u, v = footprints[_U, x], footprints[_V, x]
    step_u, step_v = footprints[_STEP_U, x], footprints[_STEP_V, x]
    away, total = _HALF * F(1 - taps), _ZERO
    for _ in range(taps):
        # One tile further, so that conversion to an integer rounds down.
        a = (u + away * step_u + _ONE) * size - _HALF
        b = (v + away * step_v + _ONE) * size - _HALF
        away += _ONE
        column, row = U(a), U(b)
        fa, fb = a - F(column), b - F(row)
        left, right = (column & last) * each, ((column + U(1)) & last) * each
        upper = start + (row & last) * line
        lower = start + ((row + U(1)) & last) * line
        t0, b0 = F(texels[upper + left]), F(texels[lower + left])
        top = t0 + fa * (F(texels[upper + right]) - t0)
        bottom = b0 + fa * (F(texels[lower + right]) - b0)
        total += top + fb * (bottom - top)
    return total
