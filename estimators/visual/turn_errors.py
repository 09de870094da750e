"""How well a point agrees with a turn: paper 1's eq. (20), and the Sampson error (SPEC 1.3).

Both vanish for the same points, those of Fig. 5. The paper's difference of ratios has poles where
its denominators vanish, so that no threshold suits all of an image; the Sampson error is the same
condition in pixels. Points are levelled, and ranges count from the track centre (z + a).
"""

from collections.abc import Callable

import numpy as np

from grouser.estimators.visual.planar import LevelledPoints
from grouser.geometry import Array

TurnError = Callable[[LevelledPoints, Array, float], Array]
"""Errors (k, n), not negative, of n points under turns (k,) [rad]; last comes a / B (SPEC 1.2)."""


def ratio_errors(points: LevelledPoints, turns: Array, lever: float) -> Array:
    """|tan(alpha') / tan(alpha) - sin(gamma') / sin(gamma)| (k, n), eq. (20); NaN at its poles."""
    (U, V, Z), (U_, V_, Z_) = _from_track_centre(points, lever)
    across, across_ = _across(U, Z, U_, Z_, turns)
    # tan(alpha) = V / |(U, Z)| and sin(gamma) = across / |(U, Z)|: the lengths appear in both.
    lengths = np.hypot(U, Z) / np.hypot(U_, Z_)
    with np.errstate(divide="ignore", invalid="ignore"):
        errors = np.abs(lengths * (V_ / V - across_ / across))
    return np.asarray(np.where(np.isfinite(errors), errors, np.nan))


def sampson_errors(points: LevelledPoints, turns: Array, lever: float) -> Array:
    """|e_S| (k, n) [px] (SPEC 1.3)."""
    (U, V, Z), (U_, V_, Z_) = _from_track_centre(points, lever)
    across, across_ = _across(U, Z, U_, Z_, turns)
    c = np.cos(turns / 2)[:, None]
    size = np.sqrt((V_ * c) ** 2 + across_**2 + (V * c) ** 2 + across**2)
    return np.asarray(np.abs(V_ * across - V * across_) / np.maximum(size, _TINY))


TURN_ERRORS: dict[str, tuple[TurnError, float]] = {
    "sampson": (sampson_errors, 0.9),
    "ratio": (ratio_errors, 0.05),
}
"""Errors by name, with an inlier's limit: three sigmas of 0.3 px (SPEC 1.3), and one of ours."""
_TINY = 1e-300


def _from_track_centre(points: LevelledPoints, lever: float) -> tuple[Array, Array]:
    """U, V, Z (3, n) of both frames, Z taken from the track centre instead of the camera [px]."""
    forward = np.array([[0.0], [0.0], [lever]])
    return points.q.T + forward * points.d, points.q_.T + forward * points.d_


def _across(U: Array, Z: Array, U_: Array, Z_: Array, turns: Array) -> tuple[Array, Array]:
    """Distances (k, n) from the chord's line, before and after, over the points' scales."""
    c, s = np.cos(turns / 2)[:, None], np.sin(turns / 2)[:, None]
    return U * c + Z * s, U_ * c - Z_ * s
