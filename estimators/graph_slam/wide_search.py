"""Correlative search over a wide window, which tells where else a scan would fit almost as well."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from grouser.estimators.scan_matching.nearest_field import NearestField, tile_at
from grouser.geometry import Array
from grouser.kernels import kernel_using

_STEP, _TURN = 0.2, np.radians(2.0)  # m, rad
_SIGMA = 0.15
"""m of distance at which a point counts exp(-1/2): with steps of 0.2 m no fit is missed."""
_POINTS = 90
_APART = 0.6
"""m between two poses that are not the same place"""


@dataclass(frozen=True, slots=True)
class Window:
    """Poses to try, about a guess."""

    position: float
    """m to either side"""
    heading: float
    """rad to either side"""


def best_fits(
    points: Array, field: NearestField, guess: Array, window: Window, most: int
) -> tuple[Array, Array]:
    """The poses (k, 3) that most points fit from, k at most `most`, and the share that does.

    The first is the best; each other is the best that lies apart from those before it.
    """
    few = np.ascontiguousarray(points[:: -(-len(points) // _POINTS)])
    n, n_turns = (
        max(1, int(np.ceil(reach / step)))
        for reach, step in ((window.position, _STEP), (window.heading, _TURN))
    )
    fits = np.exp(field.squared * np.float32(-0.5 / _SIGMA**2))
    sums, turns = _fits(few, field, fits, guess, n, _STEP, n_turns, _TURN)
    shares = sums / max(len(few), 1)
    poses, found = [], []
    offsets = _STEP * np.arange(-n, n + 1)
    for _ in range(most):
        i, j = np.unravel_index(np.argmax(shares), shares.shape)
        if not shares[i, j] > 0:
            break
        at = np.array([offsets[i], offsets[j], _TURN * turns[i, j]])
        poses.append(guess + at)
        found.append(shares[i, j])
        shares = np.where(np.hypot(*np.ix_(offsets - at[0], offsets - at[1])) < _APART, 0.0, shares)
    return np.array(poses).reshape(-1, 3), np.array(found)


@kernel_using(tile_at)
def _fits(
    points: Array,
    field: NearestField,
    fits: NDArray[np.float32],
    guess: Array,
    n: int,
    step: float,
    n_turns: int,
    turn: float,
) -> tuple[Array, NDArray[np.int64]]:
    """(2n+1, 2n+1) sum of fits at the best heading, and which heading that is."""
    best = np.full((2 * n + 1, 2 * n + 1), -1.0)
    turns = np.zeros((2 * n + 1, 2 * n + 1), dtype=np.int64)
    for k in range(-n_turns, n_turns + 1):
        c, s = np.cos(guess[2] + k * turn), np.sin(guess[2] + k * turn)
        for i in range(-n, n + 1):
            for j in range(-n, n + 1):
                x0, y0 = guess[0] + i * step, guess[1] + j * step
                total = 0.0
                for p in range(len(points)):
                    tile, u, v = tile_at(
                        field,
                        x0 + c * points[p, 0] - s * points[p, 1],
                        y0 + s * points[p, 0] + c * points[p, 1],
                    )
                    if tile >= 0:
                        total += fits[tile, u, v]
                if total > best[i + n, j + n]:
                    best[i + n, j + n] = total
                    turns[i + n, j + n] = k
    return best, turns
