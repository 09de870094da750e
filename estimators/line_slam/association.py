"""Which line of the map is it that was seen, or is it a new one (SPEC 2.2, data association)."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from grouser.checks import require_positive
from grouser.estimators.line_slam.end_points import EndPoints
from grouser.estimators.line_slam.gating import Fit, cross_covariances, fit
from grouser.estimators.line_slam.joint_compatibility import largest_joint_set
from grouser.estimators.line_slam.measurements import LineMeasurements
from grouser.estimators.line_slam.state import LineState
from grouser.geometry import Array, compose


@dataclass(frozen=True, slots=True)
class AssociationOptions:
    """When a line that was seen is one of the map, and when it is new."""

    gate: float = 9.21
    """d2, of two degrees of freedom, up to which two lines are one: chi2(.99)."""
    new_above: float = 25.0
    """d2 to the nearest above which a line is new; in between it may be either, and is left out."""
    slack: float = 3.0
    """m that a line may have been seen beyond its known end."""
    open_slack: float = 15.0
    """The same at an end beyond which it may go on, m."""
    two_sided: bool = False
    """Whether the sides of a line are different ones, as those of a wall are."""

    def __post_init__(self) -> None:
        require_positive(self, "gate", "new_above", "slack", "open_slack")

    @property
    def joint_gate(self) -> float:
        """For two pairs at once: as unlikely as the gate of one."""
        return float(chi2.isf(chi2.sf(self.gate, 2), 4))


@dataclass(frozen=True, slots=True)
class Pairs:
    """Lines seen beside lines of the map."""

    seen: NDArray[np.intp]
    """(k,)"""
    lines: NDArray[np.intp]
    """(k,) of the map"""
    new: NDArray[np.intp]
    """(l,) lines seen that are none of the map's"""


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
        none = np.zeros(0, dtype=np.intp)
        return Pairs(none, none, np.arange(len(seen)))
    fitted = fit(state, rows, seen, two_sided=options.two_sided)
    beside = end_points.overlaps(
        state.lines,
        ends_in_world(seen.ends, state.pose),
        slack=options.slack,
        open_slack=options.open_slack,
    )
    i, j = np.nonzero(beside & (fitted.d2 < options.gate))
    believed = largest_joint_set(
        i,
        fitted.residuals[i, j],
        cross_covariances(state.buffer, state.head, rows, j),
        _noises(seen, fitted, i, j),
        (fitted.d2 + fitted.log_det)[i, j],
        options.joint_gate,
    )
    nearest = np.where(beside, fitted.d2, np.inf).min(axis=1)
    return Pairs(i[believed], j[believed], np.nonzero(nearest > options.new_above)[0])


def ends_in_world(ends: Array, pose: Array) -> Array:
    """(..., 2) points in the frame of a pose (3,), in its parent."""
    there = np.concatenate([ends, np.zeros((*ends.shape[:-1], 1))], axis=-1)
    return compose(pose, there)[..., :2]


def _noises(seen: LineMeasurements, fitted: Fit, i: NDArray[np.intp], j: NDArray[np.intp]) -> Array:
    """(k, 2, 2) R of each pair, F R F where what was seen is turned over."""
    R = seen.covariances[i].copy()
    flip = np.where(fitted.turned[i, j], -1.0, 1.0)
    R[:, 0, 1] *= flip
    R[:, 1, 0] *= flip
    return R
