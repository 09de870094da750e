"""Two lines of the map that turn out to be one (SPEC 2.2, for real scans)."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from grouser.checks import require_positive
from grouser.estimators.line_slam.end_points import EndPoints
from grouser.estimators.line_slam.state import LineState
from grouser.geometry import Array, wrap


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
    for other in _candidates(state.lines, end_points.extents, line, options, two_sided):
        kept, gone = sorted((int(other), line))
        twins = _twins(state, kept, gone)
        covariance = state.covariance(twins.indices)
        C = twins.H @ covariance @ twins.H.T + EXACT
        # Where both lie, not at the foot of the origin, which may be far away.
        lever = np.array([[1.0, -_middle(end_points.extents, kept, gone, state.lines)], [0.0, 1.0]])
        at_hand = lever @ C @ lever.T
        if (
            max(
                np.sqrt(at_hand[0, 0]) / options.known_to,
                np.sqrt(at_hand[1, 1]) / options.known_to_angle,
            )
            > 1
        ):
            continue
        if twins.difference @ np.linalg.solve(C, twins.difference) < options.gate:
            return twins
    return None


def _candidates(
    lines: Array, extents: Array, line: int, options: MergingOptions, two_sided: bool
) -> NDArray[np.intp]:
    """Lines that point the same way, lie beside it, and no farther from it than a difference that
    is known well enough may be."""
    r, alpha = lines[:, 0], lines[:, 1]
    cosine = np.cos(alpha - alpha[line])
    same = cosine > np.cos(_ROUGHLY) if two_sided else np.abs(cosine) > np.cos(_ROUGHLY)
    flipped = cosine < 0
    first = np.where(flipped, -extents[:, 1], extents[:, 0])
    last = np.where(flipped, -extents[:, 0], extents[:, 1])
    low, high = extents[line] + np.array([-options.slack, options.slack])
    same &= (first <= high) & (last >= low)
    middles = 0.5 * (np.maximum(first, extents[line, 0]) + np.minimum(last, extents[line, 1]))
    apart = r - (r[line] * cosine + middles * np.sin(alpha - alpha[line]))
    same &= np.abs(apart) < np.sqrt(options.gate) * options.known_to + _CURVED
    same[line] = False
    return np.nonzero(same)[0]


def _twins(state: LineState, kept: int, gone: int) -> Twins:
    H = np.hstack([-np.eye(2), np.eye(2)])
    difference = state.lines[gone] - state.lines[kept]
    difference[1] = wrap(difference[1])
    if abs(difference[1]) > np.pi / 2:  # one is written the other way about
        H[0, 2] = -1.0
        difference[0] = -state.lines[gone, 0] - state.lines[kept, 0]
        difference[1] = wrap(difference[1] + np.pi)
    return Twins(kept, gone, state.states_of(kept) + state.states_of(gone), H, difference)


def _middle(extents: Array, kept: int, gone: int, lines: Array) -> float:
    """Where along the kept line the two lie beside each other, m."""
    places = extents[gone]
    if np.cos(lines[kept, 1] - lines[gone, 1]) < 0:
        places = -places[::-1]
    low, high = max(places[0], extents[kept, 0]), min(places[1], extents[kept, 1])
    return float((low + high) / 2)


EXACT = 1e-8 * np.eye(2)
"""(2, 2) how well the difference of two lines that are one is known: zero, but for rounding."""

_ROUGHLY = 0.3  # rad
_CURVED = 0.1  # m: of an offset, what its derivative may miss
