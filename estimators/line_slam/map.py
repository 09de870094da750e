"""A map of lines with how well they are known, as a value: what a SLAM estimator leaves behind."""

from abc import ABC, abstractmethod
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from grouser.estimators.line_slam.lines import points_on
from grouser.frozen import freeze, rebuilt
from grouser.geometry import Array

_ASYMMETRY = 1e-9
"""Of a covariance, over its largest entry: what rounding leaves."""


@dataclass(frozen=True, slots=True, eq=False)
class LineMap:
    """n lines in the frame of the start, in normal form as `lines.py` says, and frozen.

    Two maps are equal where all their numbers are.

    Raises:
        ValueError: arrays that do not fit each other, numbers that are not finite, a covariance
            that is not symmetric, or an extent that ends before it begins.
    """

    lines: Array
    """(n, 2) r [m], alpha [rad]."""
    covariance: Array
    """(2n, 2n) of r_1, alpha_1, r_2, alpha_2, ...: what is not on its diagonal of 2 x 2 blocks says
    how far the lines are off together, which is why a map is better than its lines."""
    extents: Array
    """(n, 2) where each begins and ends along its tangent, m."""
    open_ends: NDArray[np.bool_]
    """(n, 2) whether it may go on beyond that end, which was hidden or out of range."""
    counts: NDArray[np.int64]
    """(n,) how often each was seen."""

    def __post_init__(self) -> None:
        n = len(self.lines)
        kinds: dict[str, tuple[tuple[int, ...], type[Any]]] = {
            "lines": ((n, 2), np.float64),
            "covariance": ((2 * n, 2 * n), np.float64),
            "extents": ((n, 2), np.float64),
            "open_ends": ((n, 2), np.bool_),
            "counts": ((n,), np.int64),
        }
        for name, (shape, kind) in kinds.items():
            object.__setattr__(self, name, _own(name, getattr(self, name), n, shape, kind))
        object.__setattr__(self, "covariance", _symmetric(self.covariance))
        if (self.extents[:, 1] < self.extents[:, 0]).any():
            raise ValueError("extents of a line map must not end before they begin")
        if (self.counts < 0).any():
            raise ValueError("counts of a line map must be zero or more")
        freeze(self)

    def __len__(self) -> int:
        """How many lines."""
        return len(self.lines)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, LineMap) and all(
            np.array_equal(getattr(self, f.name), getattr(other, f.name)) for f in fields(self)
        )

    def __hash__(self) -> int:
        return hash((self.lines.tobytes(), self.extents.tobytes()))

    def __reduce__(self) -> tuple[Any, ...]:
        return rebuilt(self)

    @property
    def ends(self) -> Array:
        """(n, 2, 2) the first and the last known point of each line, x and y [m]."""
        return points_on(self.lines[:, None], self.extents)

    @property
    def line_covariances(self) -> Array:
        """(n, 2, 2) of each line by itself."""
        n = len(self)
        blocks = self.covariance.reshape(n, 2, n, 2)
        return blocks[np.arange(n), :, np.arange(n), :]

    def offset_sigmas(self, t: ArrayLike) -> Array:
        """(n, m) how far each line may be off across itself at places t (n, m) along it, m."""
        return offset_sigmas(self.line_covariances, t)


class LineMapper(ABC):
    """What an estimator is besides that makes a map of lines, or finds its way by one."""

    @property
    @abstractmethod
    def map(self) -> LineMap:
        """The lines as they are known now, in the frame of the start; a map by which the way is
        found, as it was given.

        Raises:
            RuntimeError: `reset` was not called yet.
        """


def offset_sigmas(covariances: ArrayLike, t: ArrayLike) -> Array:
    """(n, m) one sigma across lines at places along them, m.

    A line that is off by (dr, dalpha) is off across itself by dr - t dalpha at the place t, to
    first order; so it is known best where that is smallest, and the band about it is a hyperbola.

    Args:
        covariances: (n, 2, 2) of r and alpha.
        t: (n, m) places along the tangents, m.
    """
    C, t = np.asarray(covariances, dtype=np.float64), np.asarray(t, dtype=np.float64)
    rr, ra, aa = (C[:, i, j, None] for i, j in ((0, 0), (0, 1), (1, 1)))
    return np.asarray(np.sqrt(np.maximum(rr - 2 * t * ra + t**2 * aa, 0.0)))


def _own(
    name: str, value: ArrayLike, n: int, shape: tuple[int, ...], kind: type[Any]
) -> NDArray[Any]:
    """A copy, of that shape and type."""
    array = np.array(value)
    if array.shape != shape:
        raise ValueError(f"{name} of a map of {n} lines must have shape {shape}, got {array.shape}")
    own = array.astype(kind)
    if not (own == array).all() or not np.isfinite(own).all():
        raise ValueError(f"{name} of a line map must be finite, of type {kind.__name__}")
    return own


def _symmetric(covariance: Array) -> Array:
    """The covariance, exactly symmetric."""
    largest = float(np.abs(covariance).max(initial=0.0))
    if np.abs(covariance - covariance.T).max(initial=0.0) > _ASYMMETRY * largest:
        raise ValueError("covariance of a line map must be symmetric")
    if (np.diag(covariance) < 0).any():
        raise ValueError("covariance of a line map must have no negative variance")
    return np.asarray((covariance + covariance.T) / 2)
