"""The grain of every material: grey levels of a tile (size, size) that continues in the next."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from grouser.kernels import kernel

Image = NDArray[np.float64]


def coloured_noise(
    rng: np.random.Generator, size: int, slope: float, lowest: float, *, stretch: float = 1.0
) -> Image:
    """Periodic noise of variance 1, amplitude spectrum f^-slope above `lowest` cycles a tile;
    stretched along the columns."""
    f = np.fft.fftfreq(size) * size
    frequency = np.hypot(stretch * f[:, None], f[None, :])
    amplitude = np.where(frequency >= lowest, np.maximum(frequency, 1) ** -slope, 0)
    noise = np.fft.ifft2(np.fft.fft2(rng.standard_normal((size, size))) * amplitude).real
    return np.asarray((noise - noise.mean()) / noise.std())


def grain(rng: np.random.Generator, *, size: int) -> Image:
    """Plaster or concrete: patches with a fine grain on them."""
    patches, fine = coloured_noise(rng, size, 1.2, 2), coloured_noise(rng, size, 0.4, 8)
    return np.clip(128 + 27 * patches + 22 * fine, 0, 255)


def bricks(rng: np.random.Generator, *, size: int, rows: int, columns: int) -> Image:
    """Courses of bricks of different tones in light mortar, every second one shifted by half."""
    mortar = 4
    course, column = np.divmod(np.arange(size), size // rows), size // columns
    shift = np.where(course[0] % 2 == 1, column // 2, 0)
    across = (np.arange(size)[None, :] - shift[:, None]) % size
    tones = rng.uniform(60, 140, (rows, columns))[course[0][:, None], across // column]
    joint = (course[1][:, None] < mortar) | (across % column < mortar)
    image = np.where(joint, 190.0, tones) + 14 * coloured_noise(rng, size, 0.6, 4)
    return np.clip(image, 0, 255)


def stones(
    rng: np.random.Generator,
    *,
    size: int,
    cells: int,
    tones: tuple[float, float] = (60, 230),
    gap: float = 4.0,
) -> Image:
    """Stones of different tones with dark gaps: cellular noise (Worley, SIGGRAPH 1996).

    The tones' range is in grey levels; the gaps' width in texels.
    """
    seeds = rng.random((cells, cells, 2))
    tone = rng.uniform(*tones, cells * cells)
    owner, to_gap = np.empty((size, size), dtype=np.int64), np.empty((size, size))
    _nearest_seeds(seeds, owner, to_gap)
    light = np.clip(to_gap * (size / cells) / gap, 0, 1)
    image = tone[owner] * (0.25 + 0.75 * light) + 8 * rng.standard_normal((size, size))
    return np.clip(image, 0, 255)


@kernel
def _nearest_seeds(seeds: Any, owner: Any, to_gap: Any) -> None:
    """For every texel, the nearest of the seeds, which lie one in each cell of a periodic grid,
    and how much nearer it is than the second, in cells."""
    cells, size = seeds.shape[0], owner.shape[0]
    for row in range(size):
        y = (row + 0.5) * cells / size
        for column in range(size):
            x = (column + 0.5) * cells / size
            nearest, second = np.inf, np.inf
            for r in range(int(y) - 1, int(y) + 2):
                for c in range(int(x) - 1, int(x) + 2):
                    rr, cc = r % cells, c % cells
                    dx, dy = c + seeds[rr, cc, 0] - x, r + seeds[rr, cc, 1] - y
                    distance = np.sqrt(dx * dx + dy * dy)
                    if distance < nearest:
                        nearest, second = distance, nearest
                        owner[row, column] = rr * cells + cc
                    elif distance < second:
                        second = distance
            to_gap[row, column] = second - nearest


def blades(rng: np.random.Generator, *, size: int, count: int, length: int) -> Image:
    """Grass from above: blades in all directions, the later on the earlier and brighter."""
    tile = np.ascontiguousarray(35 + 12 * coloured_noise(rng, size, 0.8, 2))
    at, angle = rng.uniform(0, size, (count, 2)), rng.uniform(0, 2 * np.pi, count)
    reach = length * rng.uniform(0.4, 1.0, count)
    tips = at + reach[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    tones = rng.uniform(60, 140, count) + np.linspace(-20, 70, count)
    _draw_lines(tile, np.stack([at, tips], axis=1).astype(np.int64), tones)
    return np.clip(tile, 0, 255)


def leaves(rng: np.random.Generator, *, size: int, count: int, length: int) -> Image:
    """Foliage: leaves of two halves in all directions, the later on the earlier and brighter."""
    tile = np.full((size, size), 25.0)
    at, angle = rng.uniform(0, size, (count, 2)), rng.uniform(0, 2 * np.pi, count)
    reach = length * rng.uniform(0.5, 1.0, count)
    tones = rng.uniform(40, 120, count) + np.linspace(-20, 80, count)
    along = reach[:, None] / 2 * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    across = 0.45 * np.stack([-along[:, 1], along[:, 0]], axis=-1)
    corners = np.stack([at - along, at + across, at + along, at - across], axis=1).astype(np.int64)
    halves = corners[:, [[0, 1, 2], [2, 3, 0]]].reshape(-1, 3, 2)
    _draw_triangles(tile, halves, (tones[:, None] * [1.0, 0.75]).ravel())
    return np.asarray(np.clip(tile, 0, 255))


def furrows(rng: np.random.Generator, *, size: int) -> Image:
    """Bark: dark furrows along the trunk between rough ridges."""
    across = coloured_noise(rng, size, 1.6, 9, stretch=4.0)
    ridges = np.minimum(np.abs(across) / 0.5, 1.0)
    rough = coloured_noise(rng, size, 0.5, 8, stretch=2.0)
    return np.clip(45 + 95 * ridges + 20 * rough, 0, 255)


def wet(rng: np.random.Generator, *, size: int) -> Image:
    """Mud: smooth patches, hardly a corner."""
    patches, ripples = coloured_noise(rng, size, 1.6, 2), coloured_noise(rng, size, 1.4, 12)
    return np.clip(120 + 18 * patches + 5 * ripples, 0, 255)


def frozen(rng: np.random.Generator, *, size: int) -> Image:
    """Ice: bright and smooth, with some faint cracks."""
    cloudy, cracked = coloured_noise(rng, size, 1.7, 2), coloured_noise(rng, size, 1.5, 2)
    cracks = np.clip(1 - np.abs(cracked) / 0.03, 0, 1)
    return np.clip(205 + 9 * cloudy - 22 * cracks, 0, 255)


# Drawn by kernels of whole numbers, and not by OpenCV, whose lines differ from version to version.


@kernel
def _draw_lines(tile: Any, ends: Any, tones: Any) -> None:
    """Lines two texels wide between corners (n, 2, 2), x before y; what leaves the tile on one
    side enters on the other."""
    size = tile.shape[0]
    for k in range(ends.shape[0]):
        (x0, y0), (x1, y1) = ends[k, 0], ends[k, 1]
        ex, ey = x1 - x0, y1 - y0
        squared = ex * ex + ey * ey
        for y in range(min(y0, y1) - 1, max(y0, y1) + 2):
            for x in range(min(x0, x1) - 1, max(x0, x1) + 2):
                along = (x - x0) * ex + (y - y0) * ey
                beside = (x - x0) * ey - (y - y0) * ex
                if 0 <= along <= squared and beside * beside <= squared:
                    tile[y % size, x % size] = tones[k]


@kernel
def _draw_triangles(tile: Any, corners: Any, tones: Any) -> None:
    """Triangles with corners (n, 3, 2), x before y, their edges included; wrapped likewise."""
    size = tile.shape[0]
    for k in range(corners.shape[0]):
        (x0, y0), (x1, y1), (x2, y2) = corners[k, 0], corners[k, 1], corners[k, 2]
        for y in range(min(y0, y1, y2), max(y0, y1, y2) + 1):
            for x in range(min(x0, x1, x2), max(x0, x1, x2) + 1):
                a = (x1 - x0) * (y - y0) - (y1 - y0) * (x - x0)
                b = (x2 - x1) * (y - y1) - (y2 - y1) * (x - x1)
                c = (x0 - x2) * (y - y2) - (y0 - y2) * (x - x2)
                if (a >= 0 and b >= 0 and c >= 0) or (a <= 0 and b <= 0 and c <= 0):
                    tile[y % size, x % size] = tones[k]
