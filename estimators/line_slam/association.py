"""Which line of the map is it that was seen, or is it a new one (SPEC 2.2, data association)."""

from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from grouser.checks import require_positive
from grouser.estimators.line_slam.end_points import EndPoints
from grouser.estimators.line_slam.gating import cross_covariances, fit
from grouser.estimators.line_slam.joint_compatibility import largest_joint_set
from grouser.estimators.line_slam.lines import normals, tangents
from grouser.estimators.line_slam.measurements import LineMeasurements
from grouser.estimators.line_slam.state import LineState
from grouser.geometry import Array, compose, rotate


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
    fitted = fit(state, rows, seen, two_sided=options.two_sided)
    beside = end_points.overlaps(
        state.lines,
        ends_in_world(seen.ends, state.pose),
        slack=options.slack,
        open_slack=options.open_slack,
        unsure=options.slack_sigmas * _sigmas_along(state, seen),
    )
    i, j = np.nonzero(beside & (fitted.d2 < options.gate))
    residuals, turned = fitted.residuals[i, j], fitted.turned[i, j]
    spread = cross_covariances(state.buffer, state.head, rows, j)
    believed = largest_joint_set(
        i,
        residuals,
        spread,
        turned_about(seen.covariances[i], turned),
        (fitted.d2 + fitted.log_det)[i, j],
        options.joint_gate,
        options.margin,
    )
    nearest = np.where(beside, fitted.d2, np.inf).min(axis=1)
    return Pairs(
        i[believed],
        j[believed],
        np.nonzero(nearest > options.new_above)[0],
        residuals[believed],
        spread[np.ix_(believed, believed)],
        turned[believed],
    )


def ends_in_world(ends: Array, pose: Array) -> Array:
    """(..., 2) points in the frame of a pose (3,), in its parent."""
    there = np.concatenate([ends, np.zeros((*ends.shape[:-1], 1))], axis=-1)
    return compose(pose, there)[..., :2]


def _sigmas_along(state: LineState, seen: LineMeasurements) -> Array:
    """(m, n) how well it is known where along each line of the map what was seen lies, one sigma,
    m: by the position, and by the heading at its distance."""
    u = tangents(state.lines[:, 1])
    C = state.pose_covariance
    by_position = np.einsum("ni,ij,nj->n", u, C[:2, :2], u)
    middles = rotate(state.pose[2], seen.ends.mean(axis=1))
    by_heading = C[2, 2] * (middles @ normals(state.lines[:, 1]).T) ** 2
    return np.asarray(np.sqrt(by_position + by_heading))


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
