"""How a pose estimator errs, in numbers: drift by way and turn, covariance, loss and recovery."""

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any, Final

import numpy as np

from grouser.estimators.base import Status
from grouser.geometry import Array

STATUSES: Final = (Status.TRACKING, Status.COASTING, Status.LOST)
"""In the order of the model's tables."""

FEATURES: Final = ("m forward", "rad of turn", "rad of turn either way", "rad turned on the spot")
"""What systematic errors grow with. A turn is on the spot in part: 1 - r / hypot(r, SPOT_RADIUS) of
it, where r is its radius; tracks slip more there than in arcs."""

SPOT_RADIUS: Final = 0.4
"""m"""

GROWTH: Final = ("step", "m", "rad")
"""What variances grow with: time, way and turn, either way."""


@dataclass(frozen=True, slots=True, eq=False)
class ErrorModel:
    """A model of an estimator's errors; x [m], y [m] and heading [rad] are in the robot's frame.

    An increment of the estimate is the true one, plus systematic errors that stay the same for an
    episode, plus white noise; while the estimator tracks, a share of the error so far is taken
    back, as a map does. What is told is that, plus an error that lasts for one step.
    """

    of: str
    """The estimator's name."""
    dt: float
    """Length of a step, s."""
    source: str
    """Where it was measured, in words."""
    runs: int
    """How many were fitted to."""
    bias_mean: Array
    """(2, 3, 4) systematic error of x, y, heading (rows) by FEATURES (columns), the same always:
    while the status is TRACKING, and while it is another."""
    bias_sigma: Array
    """(2, 3, 4) how much that varies from episode to episode."""
    correction: Array
    """(3,) share of the error in x, y, heading that a step takes back, while TRACKING."""
    recovery: Array
    """(3,) share of it that is taken back when TRACKING follows another status: what is found again
    tells where the robot is."""
    growth: Array
    """(3, 3, 3) variance that the error of x, y, heading (second axis) gains by GROWTH (third), in
    each of STATUSES (first)."""
    jitter: Array
    """(3, 3) sigma of what lasts for one step, in each of STATUSES, of x, y, heading."""
    first_status: Array
    """(3,) probability of each of STATUSES at the start."""
    transitions: Array
    """(3, 3) probability that a status (row) is followed by another (column) a step later."""
    confidence: Array
    """(2, 2) sigmas that the estimator tells over those of this model, of position and of heading
    (columns): while the status is TRACKING, and while it is another."""

    def __post_init__(self) -> None:
        for name, shape in _SHAPES.items():
            values = np.array(getattr(self, name), dtype=np.float64)
            if values.shape != shape or not np.isfinite(values).all():
                raise ValueError(
                    f"{name} of an emulator must be finite numbers of shape {shape}, got "
                    f"{getattr(self, name)!r}"
                )
            values.flags.writeable = False
            object.__setattr__(self, name, values)
        for name in ("bias_sigma", "correction", "recovery", "growth", "jitter", "confidence"):
            if (getattr(self, name) < 0).any():
                raise ValueError(f"{name} of an emulator must not be negative")
        for name in ("first_status", "transitions"):
            chances = getattr(self, name)
            if (chances < 0).any() or np.abs(chances.sum(axis=-1) - 1).max() > 1e-6:
                raise ValueError(f"{name} of an emulator must be probabilities that sum up to 1")

    def to_json(self) -> dict[str, Any]:
        """Its fields, arrays as lists."""
        values = {f.name: getattr(self, f.name) for f in fields(self)}
        return {n: v.tolist() if isinstance(v, np.ndarray) else v for n, v in values.items()}

    @staticmethod
    def from_json(values: Mapping[str, Any]) -> "ErrorModel":
        """A model from its fields.

        Raises:
            ValueError: a field is missing or unknown, or has a value that it may not have.
        """
        known = {f.name for f in fields(ErrorModel)}
        if values.keys() != known:
            missing, unknown = sorted(known - set(values)), sorted(set(values) - known)
            raise ValueError(
                f"an emulator's fields are {', '.join(sorted(known))}; "
                f"missing: {missing}, unknown: {unknown}"
            )
        return ErrorModel(**values)


_SHAPES: Final[Mapping[str, tuple[int, ...]]] = {
    "bias_mean": (2, 3, 4),
    "bias_sigma": (2, 3, 4),
    "correction": (3,),
    "recovery": (3,),
    "growth": (3, 3, 3),
    "jitter": (3, 3),
    "first_status": (3,),
    "transitions": (3, 3),
    "confidence": (2, 2),
}
