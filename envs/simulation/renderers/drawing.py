"""A picture, row by row: find what each pixel shows, sample the textures, add up."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from grouser.envs.simulation.renderers.coverage import cover, list_rows
from grouser.envs.simulation.renderers.fragments import Fragments, collect, room_for_fragments
from grouser.envs.simulation.renderers.runs import room_for_marks
from grouser.envs.simulation.renderers.sampling import ONE, Taps, room_for_taps, sample
from grouser.kernels import kernel, kernel_using

F = np.float32


class Room(NamedTuple):
    """Memory for a row of pixels."""

    depth: NDArray[np.float32]
    """(S, width) inverse depth, 1/m."""
    faces: NDArray[np.int32]
    """(S, width) what each sub-sample sees."""
    marks: NDArray[np.int32]
    """Of `mark_runs`."""
    fragments: Fragments
    taps: Taps


def room_for_row(width: int, samples: int, channels: int) -> Room:
    """Memory for a row of so many pixels of so many sub-samples."""
    return Room(
        depth=np.empty((samples, width), dtype=np.float32),
        faces=np.empty((samples, width), dtype=np.int32),
        marks=room_for_marks(width),
        fragments=room_for_fragments(width, samples, channels),
        taps=room_for_taps(width * samples),
    )


@kernel_using(list_rows, cover, collect, sample)
def draw(
    visible: Any,
    n: int,
    subsamples: Any,
    bank: Any,
    anisotropy: Any,
    sky: Any,
    room: Any,
    image: Any,
) -> None:
    """Draw a picture.

    Args:
        visible: a `Visible` of n polygons.
        subsamples: (S, 2) float32 of SUBSAMPLES.
        bank: a `TextureBank`.
        anisotropy: float32, most taps along a footprint's longer axis.
        sky: a `Sky`.
        room: a `Room`, for work.
        image: out, (height, width, channels) uint8.
    """
    height, width, channels = image.shape
    rows = list_rows(visible, n, height)
    colours = np.empty((channels, width), dtype=np.float32)
    fragments = room.fragments
    for y in range(height):
        cover(visible, rows, y, subsamples, room.depth, room.faces)
        n_fragments, n_runs, any_sky = collect(
            visible, room.faces, subsamples, bank, anisotropy, y, room.marks, fragments
        )
        sample(bank, fragments, n_fragments, room.taps)
        _begin_with_sky(sky, y, fragments.sky, any_sky, colours)
        _add_fragments(fragments, n_runs, colours)
        for q in range(channels):
            _round(colours[q], image[y, :, q])


@kernel_using(list_rows, cover)
def look(visible: Any, n: int, subsamples: Any, room: Any, depth: Any, faces: Any) -> None:
    """Fill in what the first sub-sample of every pixel sees.

    Args:
        visible: a `Visible` of n polygons.
        subsamples: (S, 2) float32 of SUBSAMPLES.
        room: a `Room`, for work.
        depth: out, (height, width) m along the optical axis; inf for sky.
        faces: out, (height, width) index of the polygon, or SKY.
    """
    rows = list_rows(visible, n, faces.shape[0])
    for y in range(faces.shape[0]):
        cover(visible, rows, y, subsamples[:1], room.depth, room.faces)
        faces[y] = room.faces[0]
        for x in range(faces.shape[1]):
            i = faces[y, x]
            depth[y, x] = np.inf
            if i >= 0:
                p = visible.planes[i]
                depth[y, x] = 1 / (p[0] * x + p[1] * y + p[2])


@kernel
def _begin_with_sky(sky: Any, y: int, shares: Any, any_sky: bool, colours: Any) -> None:
    """(channels, width) the sky's share."""
    if not any_sky:
        colours[:] = F(0)
        return
    inverse_length, slope, start = sky.inverse_length[y], sky.up[0], sky.up[1] * F(y) + sky.up[2]
    for q in range(colours.shape[0]):
        colour = colours[q]
        horizon, rise = sky.horizon[q], sky.rise[q]
        for x in range(colour.size):
            up = (slope * F(np.int32(x)) + start) * inverse_length[x]
            up = up if up > F(0) else F(0)
            colour[x] = shares[x] * (horizon + up * rise)


@kernel
def _add_fragments(fragments: Any, n_runs: int, colours: Any) -> None:
    """Add what every fragment brings, a run of neighbours at a time."""
    for q in range(colours.shape[0]):
        for r in range(n_runs):
            k, x, count = fragments.runs[r]
            gain, total = fragments.gain[k : k + count], fragments.total[q, k : k + count]
            colour = colours[q, x : x + count]
            for j in range(colour.size):
                colour[j] += gain[j] * (F(total[j]) * F(1 / ONE))


@kernel
def _round(colour: Any, image: Any) -> None:
    for x in range(colour.size):
        level = colour[x] + F(0.5)
        level = level if level > F(0) else F(0)
        image[x] = np.uint8(np.int32(level if level < F(255) else F(255)))
