"""Which line of the map is it that was seen, or is it a new one (SPEC 2.2, data association)."""

from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from grouser.checks import require_positive
from grouser.estimators.line_slam.end_points import EndPoints
from grouser.estimators.line_slam.gating import candidates, cross_covariances
from grouser.estimators.line_slam.joint_compatibility import largest_joint_set
from grouser.estimators.line_slam.measurements import LineMeasurements
from grouser.estimators.line_slam.state import LineState
from grouser.geometry import Array


@dataclass(frozen=True, slots=True)
class AssociationOptions:
    """When a line that was seen is one of the map, and when it is new."""

    gate: float = 9.21
    """d2, of two degrees of freedom, up to which two lines are one: chi2(.99)."""
    new_above: float = 25.0
    """d2 to the nearest above which a line is new; in between it may be either, and is left out."""
    slack: float = 1.0
    """m that a line may have been seen beyond its known end,"""
    open_slack: float = 5.0
    """the same at an end beyond which it may go on, m,"""
    slack_sigmas: float = 3.0
    """and beside either, sigmas of where along the line the robot is."""
    margin: float = 4.0
    """By which d2 + ln |S| of another line of the map must exceed that of the one it is taken for;
    where it does not, both are left out. Odds of 1 to 7 are not taken."""
    two_sided: bool = False
    """Whether the sides of a line are different ones, as those of a wall are."""

    def __post_init__(self) -> None:
        require_positive(self, "gate", "new_above", "slack", "open_slack", "slack_sigmas")

    @property
    def joint_gate(self) -> float:
        """For two pairs at once: as unlikely as the gate of one."""
        return _as_unlikely_for_two(self.gate)


@dataclass(frozen=True, slots=True)
class Pairs:
    """Lines seen beside lines of the map."""

    seen: NDArray[np.intp]
    """(k,)"""
    lines: NDArray[np.intp]
    """(k,) of the map"""
    new: NDArray[np.intp]
    """(l,) lines seen that are none of the map's"""
    residuals: Array
    """(k, 2) nu of each pair"""
    spread: Array
    """(k, k, 2, 2) H P H^T between pairs"""
    turned: NDArray[np.bool_]
    """(k,) whether the line is written the other way about in the map"""


def associate(
    state: LineState,
    rows: Array,
    end_points: EndPoints,
    seen: LineMeasurements,
    options: AssociationOptions,
) -> Pairs:
    """The largest set of pairs that fit, alone and two by two; among equals, the likeliest.

    Args:
        rows: (n, 4) of the Jacobians, see `linearization.py`.
    """
    if len(state) == 0 or len(seen) == 0:
        return _no_pairs(np.arange(len(seen)))
    beside = end_points.beside(
        state.lines,
        state.pose,
        state.pose_covariance,
        seen.ends,
        slack=options.slack,
        open_slack=options.open_slack,
        sigmas=options.slack_sigmas,
    )
    found = candidates(
        state.buffer,
        state.mean,
        state.head,
        rows,
        beside,
        seen.lines,
        seen.covariances,
        options.gate,
        options.two_sided,
    )
    spread = cross_covariances(state.buffer, state.head, rows, found.lines)
    believed = largest_joint_set(
        found.seen,
        found.residuals,
        spread,
        found.noises,
        found.scores,
        options.joint_gate,
        options.margin,
    )
    seen_again = found.seen[believed]
    new = found.nearest > options.new_above
    new[seen_again] = False
    return Pairs(
        seen_again,
        found.lines[believed],
        np.nonzero(new)[0],
        found.residuals[believed],
        spread[believed][:, believed],
        found.turned[believed],
    )


@cache
def _as_unlikely_for_two(gate: float) -> float:
    return float(chi2.isf(chi2.sf(gate, 2), 4))


def turned_about(covariances: Array, turned: NDArray[np.bool_]) -> Array:
    """(k, 2, 2) of r and alpha, F R F where what was seen is turned over."""
    R = covariances.copy()
    flip = np.where(turned, -1.0, 1.0)
    R[:, 0, 1] *= flip
    R[:, 1, 0] *= flip
    return R


def _no_pairs(new: NDArray[np.intp]) -> Pairs:
    none = np.zeros(0, dtype=np.intp)
    return Pairs(
        none, none, new, np.zeros((0, 2)), np.zeros((0, 0, 2, 2)), np.zeros(0, dtype=np.bool_)
    )
