"""What a row of pixels takes of textures: one fragment for every surface that a pixel shows.

A pixel within one face, or across faces that continue one another, is one fragment however many
sub-samples it has; one on an edge has a fragment for each surface on it, at the centroid of the
sub-samples that see it. Runs of pixels within one face are written in a loop without branches,
which the compiler turns into vector instructions.
"""

from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from grouser.envs.simulation.renderers.runs import BEGINS, MIXED, mark_runs
from grouser.kernels import inlined, kernel, kernel_using

F = np.float32
_ZERO, _HALF, _ONE = F(0), F(0.5), F(1)
_CLOSE: Final = F(1 / 16)  # relative difference of depths at which a surface continues


class Fragments(NamedTuple):
    """Room for the fragments of one row, each array (n,) unless it says otherwise."""

    u: NDArray[np.float32]
    """Texture coordinates in [0, 1)."""
    v: NDArray[np.float32]
    step_u: NDArray[np.float32]
    """From one tap along the footprint's longer axis to the next, tiles."""
    step_v: NDArray[np.float32]
    taps: NDArray[np.float32]
    """How many there are."""
    width: NDArray[np.float32]
    """Of what one tap stands for, texels, at least 1."""
    gain: NDArray[np.float32]
    """The pixel's share of it, times its shade, a tap."""
    base: NDArray[np.int32]
    """Where its texture begins in the bank."""
    size: NDArray[np.int32]
    """Side of its texture, texels."""
    total: NDArray[np.int32]
    """(channels, n) what `sample` found."""
    runs: NDArray[np.int32]
    """(n, 3) neighbouring pixels with a fragment each: the first fragment, the first column, how
    many."""
    sky: NDArray[np.float32]
    """(width,) the sky's share of every pixel."""


def room_for_fragments(width: int, samples: int, channels: int) -> Fragments:
    """Memory for those of a row of pixels."""
    n = width * samples
    u, v, step_u, step_v, taps, footprint, gain = np.empty((7, n), dtype=np.float32)
    base, size = np.empty((2, n), dtype=np.int32)
    return Fragments(
        u, v, step_u, step_v, taps, footprint, gain, base, size,
        total=np.empty((channels, n), dtype=np.int32),
        runs=np.empty((n, 3), dtype=np.int32),
        sky=np.empty(width, dtype=np.float32),
    )  # fmt: skip


@kernel_using(mark_runs)
def collect(
    visible: Any,
    faces: Any,
    subsamples: Any,
    bank: Any,
    anisotropy: Any,
    y: int,
    marks: Any,
    out: Any,
) -> Any:
    """Fill a row's fragments; how many there are, how many runs, and whether any sky.

    Args:
        visible: a `Visible`.
        faces: (S, width), from `cover`.
        subsamples: (S, 2) float32 of SUBSAMPLES.
        bank: a `TextureBank`.
        anisotropy: float32, most taps along a footprint's longer axis.
        y: the row.
        marks: (2, width + 1) int32, for work.
        out: `Fragments`.
    """
    width = faces.shape[1]
    mark_runs(faces, marks)
    begin, n, n_runs, sky = 0, 0, 0, False
    out.sky[:] = _ZERO
    while begin < width:
        i, end = faces[0, begin], begin + 1
        while marks[BEGINS, end] == 0:
            end += 1
        if marks[MIXED, begin] != 0:
            before = n
            n = _add_edge(visible, faces, subsamples, bank, anisotropy, y, begin, out, n)
            for k in range(before, n):
                out.runs[n_runs] = k, begin, 1
                n_runs += 1
            sky = sky or out.sky[begin] > _ZERO
        elif i < 0:
            out.sky[begin:end] = _ONE
            sky = True
        else:
            out.runs[n_runs] = n, begin, end - begin
            n_runs += 1
            n = _add_run(visible, i, begin, end, F(y), bank, anisotropy, out, n)
        begin = end
    return n, n_runs, sky


@kernel
def _add_edge(
    visible: Any,
    faces: Any,
    subsamples: Any,
    bank: Any,
    anisotropy: Any,
    y: int,
    x: int,
    out: Any,
    n: int,
) -> int:
    """Add the fragments of one pixel that shows several faces."""
    n_samples = faces.shape[0]
    for s in range(n_samples):
        i = faces[s, x]
        count, dx, dy = _share(visible, faces, subsamples, s, y, x)
        share = F(count) / F(n_samples)
        if count > 0 and i < 0:
            out.sky[x] = share
        elif count > 0:
            n = _add_one(visible, i, F(x) + dx, F(y) + dy, share, bank, anisotropy, out, n)
    return n


@kernel
def _share(visible: Any, faces: Any, subsamples: Any, s: int, y: int, x: int) -> Any:
    """Sub-samples that see what sub-sample s sees, and their centroid; 0 if told before."""
    i = faces[s, x]
    count, dx, dy = 0, _ZERO, _ZERO
    for r in range(faces.shape[0]):
        if _continues(visible, faces[r, x], i, F(x), F(y)):
            if r < s:
                return 0, _ZERO, _ZERO
            count += 1
            dx += subsamples[r, 0]
            dy += subsamples[r, 1]
    return count, dx / F(count), dy / F(count)


@kernel
def _continues(visible: Any, i: int, k: int, x: Any, y: Any) -> bool:
    """Whether two faces are one, or of one surface and not one behind the other."""
    if i == k:
        return True
    if i < 0 or k < 0 or visible.surface[i] != visible.surface[k]:
        return False
    p, q = visible.planes32[i], visible.planes32[k]
    wi, wk = p[0] * x + p[1] * y + p[2], q[0] * x + q[1] * y + q[2]
    return bool(abs(wi - wk) < _CLOSE * abs(wi))


@kernel
def _add_run(
    visible: Any, i: int, begin: int, end: int, y: Any, bank: Any, anisotropy: Any, out: Any, n: int
) -> int:
    """Add the pixels [begin, end) of a row, where face i shows."""
    p, shade, texture = visible.planes32[i], visible.shade[i], visible.texture[i]
    p0, p3, p7 = p[0], p[3], p[7]
    p1, p4, p8 = p[1], p[4], p[8]
    w0, u0, v0 = p1 * y + p[2], p4 * y + p[5], p8 * y + p[9]
    u_origin, v_origin, s0, su, sv = p[6], p[10], shade[0], shade[1], shade[2]
    size, x0, count = F(bank.sizes[texture]), F(begin), end - begin
    # Views that begin at zero: an index that may be negative would keep the loop from vectors.
    to_u, to_v = out.u[n : n + count], out.v[n : n + count]
    to_step_u, to_step_v = out.step_u[n : n + count], out.step_v[n : n + count]
    to_taps, to_width = out.taps[n : n + count], out.width[n : n + count]
    to_gain = out.gain[n : n + count]
    for k in range(to_u.size):
        x = x0 + F(np.int32(k))
        z = _ONE / (p0 * x + w0)
        du, dv = (p3 * x + u0) * z, (p7 * x + v0) * z
        u, v = du + u_origin, dv + v_origin
        step_u, step_v, taps, width = _footprint(
            p3 - du * p0, p4 - du * p1, p7 - dv * p0, p8 - dv * p1, z, size, anisotropy
        )
        to_u[k], to_v[k] = _fraction(u), _fraction(v)
        to_step_u[k], to_step_v[k] = step_u, step_v
        to_taps[k], to_width[k] = taps, width
        to_gain[k] = (s0 + su * u + sv * v) / taps
    out.base[n : n + count], out.size[n : n + count] = bank.offsets[texture, 0], bank.sizes[texture]
    return n + count


@kernel
def _add_one(
    visible: Any, i: int, x: Any, y: Any, share: Any, bank: Any, anisotropy: Any, out: Any, n: int
) -> int:
    """Add a share of a pixel, sampled at (x, y), where face i shows."""
    p, shade, texture = visible.planes32[i], visible.shade[i], visible.texture[i]
    z = _ONE / (p[0] * x + (p[1] * y + p[2]))
    du, dv = (p[3] * x + (p[4] * y + p[5])) * z, (p[7] * x + (p[8] * y + p[9])) * z
    u, v = du + p[6], dv + p[10]
    size = bank.sizes[texture]
    out.step_u[n], out.step_v[n], taps, out.width[n] = _footprint(
        p[3] - du * p[0], p[4] - du * p[1], p[7] - dv * p[0], p[8] - dv * p[1], z, F(size),
        anisotropy,
    )  # fmt: skip
    out.u[n], out.v[n], out.taps[n] = _fraction(u), _fraction(v), taps
    out.gain[n] = share * (shade[0] + shade[1] * u + shade[2] * v) / taps
    out.base[n], out.size[n] = bank.offsets[texture, 0], size
    return n + 1


@inlined
def _footprint(ux: Any, uy: Any, vx: Any, vy: Any, z: Any, size: Any, anisotropy: Any) -> Any:
    """Step between taps in u and v [tiles], number of taps and width of each [texels], from z
    times which the derivatives of u and v by the pixel are (exact).

    Every operation is one that vector units have, and conditions are selections, not branches.
    """
    across, down = ux * ux + vx * vx, uy * uy + vy * vy
    lying, texels = across > down, z * size
    longer = texels * np.sqrt(across if lying else down)
    shorter = texels * np.sqrt(down if lying else across)
    taps = F(np.int32(longer / (shorter if shorter > _ONE else _ONE) + _HALF))
    taps = taps if taps > _ONE else _ONE
    taps = taps if taps < anisotropy else anisotropy
    width, coarsest = longer / taps, size * _HALF
    width = width if width > _ONE else _ONE
    # The taps together reach over one tile at most.
    step = texels / (taps * (longer if longer > size else size))
    return (
        (ux if lying else uy) * step,
        (vx if lying else vy) * step,
        taps,
        width if width < coarsest else coarsest,
    )


@inlined
def _fraction(x: Any) -> Any:
    """x - floor(x) in operations that vector units have."""
    whole = F(np.int32(x))
    return x - (whole if whole <= x else whole - _ONE)
