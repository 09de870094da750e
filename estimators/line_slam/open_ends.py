"""Whether a line may go on beyond the last return of it: who looks past an end sees it end."""

import math

import numpy as np
from numpy.typing import NDArray

from grouser.estimators.line_slam.break_points import joined
from grouser.estimators.line_slam.line_fit import squared_sigmas_off
from grouser.estimators.line_slam.returns import Returns, Spacing
from grouser.geometry import Array
from grouser.kernels import kernel, kernel_using

_SURE = 9.0  # squared sigmas: a return that is farther away from a line is not of it


@kernel_using(joined, squared_sigmas_off)
def open_ends(
    scan: tuple[Array, Array, Array],
    returns: Returns,
    spacing: Spacing,
    reach: float,
    pieces: NDArray[np.intp],
    lines: Array,
) -> NDArray[np.bool_]:
    """(k, 2) whether each line may go on before its first and after its last return.

    The next few beams say so. It ends where one met another surface that joins it, a corner; or
    something behind it; or where they met nothing, although the line would have been near. It may
    go on where something in front hides it, where it is met too flatly, or where no beam is.

    Args:
        scan: (n,) ranges [m], (n, 2) origins [m], (n, 2) directions of all beams, as in `Scan`.
        reach: m up to which every surface returns something.
        pieces: (k, 2) first and last return of each line; lines: (k, 2) r and alpha.
    """
    at_beam = np.full(spacing.n_beams, -1, dtype=np.intp)
    for i in range(len(returns.beams)):
        at_beam[returns.beams[i]] = i
    may_go_on = np.ones((len(pieces), 2), dtype=np.bool_)
    for k in range(len(pieces)):
        for end in range(2):
            own = pieces[k, end] % len(returns.beams)
            passed = False  # the line, if it was there, by a beam that met nothing
            for step in range(1, spacing.missing + 2):
                beam = _beside(returns.beams[own], step * (2 * end - 1), spacing)
                if beam < 0:
                    break
                crossing = _crossing(scan[1][beam], scan[2][beam], lines[k])
                if np.isinf(scan[0][beam]):
                    passed = passed or 0 < crossing < reach
                other = at_beam[beam]
                if other < 0 or _is_on(lines[k], returns, other):
                    continue
                earlier, later = (own, other) if end == 1 else (other, own)
                passed = 0 < crossing < scan[0][beam]
                passed = passed or joined(returns, earlier, later, spacing)
                break
            may_go_on[k, end] = not passed
    return may_go_on


@kernel
def _beside(beam: int, steps: int, spacing: Spacing) -> int:
    """The beam so many steps further around; -1 where there is none."""
    other = beam + steps
    if spacing.seam > 0:
        return other % spacing.n_beams
    return other if 0 <= other < spacing.n_beams else -1


@kernel
def _crossing(origin: Array, way: Array, line: Array) -> float:
    """The range at which a beam meets a line; infinite, or negative, where it does not."""
    c, s = math.cos(line[1]), math.sin(line[1])
    return float((line[0] - c * origin[0] - s * origin[1]) / (c * way[0] + s * way[1]))


@kernel_using(squared_sigmas_off)
def _is_on(line: Array, returns: Returns, i: int) -> bool:
    """Whether a return is as close to a line as its noise may have moved it."""
    point, by_range, by_bearing = returns.points[i], returns.by_range[i], returns.by_bearing[i]
    off = squared_sigmas_off(point, by_range, by_bearing, line[0], line[1])
    return bool(off < _SURE)
