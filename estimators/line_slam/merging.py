"""Two lines of the map that turn out to be one (SPEC 2.2, for real scans)."""

import math
from dataclasses import dataclass

import numpy as np

from grouser.checks import require_positive
from grouser.estimators.line_slam.end_points import EndPoints
from grouser.estimators.line_slam.state import LineState
from grouser.estimators.visual.single_pose import wrapped
from grouser.geometry import Array, wrap
from grouser.kernels import kernel, kernel_using


@dataclass(frozen=True, slots=True)
class MergingOptions:
    """When two lines of the map are one."""

    gate: float = 9.21
    """Squared difference over its covariance, of two degrees of freedom: chi2(.99)."""
    known_to: float = 0.25
    """m, one sigma: two lines whose distance is known worse stay two, however well they fit."""
    known_to_angle: float = 0.1
    """rad, likewise"""
    slack: float = 0.5
    """m that may lie between their known parts."""

    def __post_init__(self) -> None:
        require_positive(self, "gate", "known_to", "known_to_angle", "slack")


@dataclass(frozen=True, slots=True)
class Twins:
    """Lines `kept` and `gone` of the map are one, with a difference (2,) that should be zero."""

    kept: int
    gone: int
    indices: list[int]
    """(4,) their states"""
    H: Array
    """(2, 4) derivative of the difference by those"""
    difference: Array
    """(2,) gone minus kept"""


def find_twins(
    state: LineState,
    end_points: EndPoints,
    line: int,
    options: MergingOptions,
    *,
    two_sided: bool,
) -> Twins | None:
    """The line of the map that a line is one with, the older of the two to be kept; None where
    there is none."""
    other = _find_twin(
        state.buffer,
        state.head,
        state.lines,
        end_points.extents,
        line,
        options.gate,
        options.known_to,
        options.known_to_angle,
        options.slack,
        two_sided,
    )
    return None if other < 0 else _twins(state, min(line, other), max(line, other))


@kernel_using(wrapped)
def _find_twin(
    P: Array,
    head: int,
    lines: Array,
    extents: Array,
    line: int,
    gate: float,
    known_to: float,
    known_to_angle: float,
    slack: float,
    two_sided: bool,
) -> int:
    """The first line that is one with `line`; -1 where none is."""
    for other in range(len(lines)):
        if other == line:
            continue
        cosine = math.cos(lines[other, 1] - lines[line, 1])
        if (cosine if two_sided else abs(cosine)) <= math.cos(_ROUGHLY):
            continue
        if not _near(lines, extents, line, other, cosine, gate, known_to, slack):
            continue
        kept, gone = min(line, other), max(line, other)
        flip = -1.0 if cosine < 0 else 1.0
        c00, c01, c11 = _difference_covariance(P, head + 2 * kept, head + 2 * gone, flip)
        # Where both lie, not at the foot of the origin, which may be far away.
        first, last = _turned_extent(extents[gone], flip)
        middle = (max(first, extents[kept, 0]) + min(last, extents[kept, 1])) / 2
        at_hand = c00 - 2 * middle * c01 + middle * middle * c11
        if not (math.sqrt(at_hand) <= known_to and math.sqrt(c11) <= known_to_angle):
            continue
        dr = flip * lines[gone, 0] - lines[kept, 0]
        da = wrapped(lines[gone, 1] - lines[kept, 1])
        if flip < 0:
            da = wrapped(da + math.pi)
        if (c11 * dr * dr - 2 * c01 * dr * da + c00 * da * da) / (c00 * c11 - c01 * c01) < gate:
            return other
    return -1


@kernel
def _near(
    lines: Array,
    extents: Array,
    line: int,
    other: int,
    cosine: float,
    gate: float,
    known_to: float,
    slack: float,
) -> bool:
    """Whether two lines that point the same way lie beside each other, and no farther apart than a
    difference that is known well enough may be."""
    first, last = _turned_extent(extents[other], -1.0 if cosine < 0 else 1.0)
    if first > extents[line, 1] + slack or last < extents[line, 0] - slack:
        return False
    middle = 0.5 * (max(first, extents[line, 0]) + min(last, extents[line, 1]))
    turn = lines[other, 1] - lines[line, 1]
    apart = lines[other, 0] - (lines[line, 0] * cosine + middle * math.sin(turn))
    return bool(abs(apart) < math.sqrt(gate) * known_to + _CURVED)


@kernel
def _turned_extent(extent: Array, flip: float) -> tuple[float, float]:
    """First and last place, of a line that is written the other way about if flip is -1."""
    return (-extent[1], -extent[0]) if flip < 0 else (extent[0], extent[1])


@kernel
def _difference_covariance(P: Array, k: int, g: int, flip: float) -> tuple[float, float, float]:
    """Of (flip r, alpha) of the line with states from g on, less that with states from k on."""
    c00 = P[k, k] + P[g, g] - 2 * flip * P[k, g]
    c01 = P[k, k + 1] - P[k, g + 1] - flip * P[k + 1, g] + flip * P[g, g + 1]
    c11 = P[k + 1, k + 1] + P[g + 1, g + 1] - 2 * P[k + 1, g + 1]
    return c00 + _EXACT, c01, c11 + _EXACT


def _twins(state: LineState, kept: int, gone: int) -> Twins:
    H = np.hstack([-np.eye(2), np.eye(2)])
    difference = state.lines[gone] - state.lines[kept]
    difference[1] = wrap(difference[1])
    if abs(difference[1]) > np.pi / 2:  # one is written the other way about
        H[0, 2] = -1.0
        difference[0] = -state.lines[gone, 0] - state.lines[kept, 0]
        difference[1] = wrap(difference[1] + np.pi)
    return Twins(kept, gone, state.states_of(kept) + state.states_of(gone), H, difference)


_EXACT = 1e-8
EXACT = _EXACT * np.eye(2)
"""(2, 2) how well the difference of two lines that are one is known: zero, but for rounding."""

_ROUGHLY = 0.3  # rad
_CURVED = 0.1  # m: of an offset, what its derivative may miss
