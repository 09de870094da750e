"""How far an estimator was off on a course, in the paper's terms: x, y and heading, signed.

The paper gives an average and a standard deviation of the errors without saying of what; here they
are those of all frames but the first, of all sets of a kind. x is along the heading of the start.
"""

from collections.abc import Sequence

import numpy as np

from grouser.geometry import Array, wrap
from grouser.scripts.reproduction.experiment import Outcome

AXES = ("x", "y", "heading")
UNITS = ("mm", "mm", "deg")


def course_errors(outcome: Outcome, label: str) -> Array:
    """(n, 3) estimate minus truth in every frame but the first: x, y [mm], heading [deg]."""
    error = np.array(outcome[f"{label}.pose"] - outcome["true_pose"])[1:]
    error[:, 2] = wrap(error[:, 2])
    return np.asarray(error * [1e3, 1e3, np.degrees(1.0)])


def distance(outcome: Outcome) -> float:
    """Way truly driven, m."""
    steps = np.diff(outcome["true_pose"][:, :2], axis=0)
    return float(np.linalg.norm(steps, axis=1).sum())


def turned(outcome: Outcome) -> Array:
    """(n + 1,) true heading without jumps, rad."""
    return np.asarray(np.unwrap(outcome["true_pose"][:, 2]))


def average_and_deviation(errors: Array) -> dict[str, float]:
    """The paper's two figures of each axis."""
    values = {}
    for k, (axis, unit) in enumerate(zip(AXES, UNITS, strict=True)):
        values[f"{axis}_average_{unit}"] = float(errors[:, k].mean())
        values[f"{axis}_deviation_{unit}"] = float(errors[:, k].std())
    return values


def sizes(errors: Sequence[Array]) -> dict[str, float]:
    """How large the errors of one or more sets are, whatever their sign: means over all frames,
    and over the last frames of the sets."""
    everywhere = np.concatenate(errors)
    ends = np.array([of_set[-1] for of_set in errors])
    return {
        "position_mean_mm": _mean_length(everywhere),
        "position_end_mm": _mean_length(ends),
        "heading_mean_deg": float(np.abs(everywhere[:, 2]).mean()),
        "heading_end_deg": float(np.abs(ends[:, 2]).mean()),
    }


def _mean_length(errors: Array) -> float:
    return float(np.linalg.norm(errors[:, :2], axis=1).mean())
