"""Lines from a sensor that reports the ends of their visible parts (paper 2; SPEC 2.2)."""

import numpy as np
from numpy.typing import NDArray

from grouser.estimators.line_slam.lines import line_through, normals, turned_over
from grouser.estimators.line_slam.measurements import LineMeasurements, no_lines
from grouser.geometry import Array
from grouser.rig_motion import LineSensor

_SHORTEST = 0.5  # m: of a shorter part, the ends' noise leaves the direction open
_AT_RANGE_LIMIT = 0.5  # m: an end seen so near to the range limit may be no true end


def measure_lines(reported: NDArray[np.float64], sensor: LineSensor) -> LineMeasurements:
    """The lines through ends as an observation `lines` (max_lines, 4) reports them.

    Raises:
        ValueError: it has another shape, or is not finite.
    """
    reported = np.asarray(reported, dtype=np.float64)
    if reported.ndim != 2 or reported.shape[1] != 4 or not np.isfinite(reported).all():
        raise ValueError(
            "observation 'lines' must be finite rows of range and bearing of a line's first and "
            f"last visible point, (n, 4), got {reported.tolist()} of shape {reported.shape}"
        )
    rows = reported[reported.any(axis=1)]
    ranges, bearings = rows[:, 0::2], rows[:, 1::2]
    directions = normals(bearings)  # (n, 2, 2) to either end
    ends = ranges[..., None] * directions
    seen = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=-1) >= _SHORTEST
    if not seen.any():
        return no_lines()
    ranges, directions, ends = ranges[seen], directions[seen], ends[seen]
    lines = line_through(ends[:, 0], ends[:, 1])
    covariances = line_covariances(lines, ranges, directions, ends, sensor)
    behind = lines[:, 0] < 0
    lines[behind] = turned_over(lines[behind])
    covariances[behind] *= _TURNED_OVER
    ends[behind] = ends[behind, ::-1]
    open_ends = np.where(behind[:, None], ranges[:, ::-1], ranges)
    return LineMeasurements(
        lines,
        covariances,
        ends,
        _end_sigmas(lines, ends, sensor),
        open_ends > sensor.range_max - _AT_RANGE_LIMIT,
    )


def line_covariances(
    lines: Array, ranges: Array, directions: Array, ends: Array, sensor: LineSensor
) -> Array:
    """(n, 2, 2) of r and alpha of the lines (n, 2) through ends (n, 2, 2), seen along unit vectors
    `directions` (n, 2, 2) at `ranges` (n, 2): SPEC 2.2, end-point sensor."""
    n = normals(lines[:, 1])[:, None, :]
    u = np.stack([-n[..., 1], n[..., 0]], axis=-1)
    across = np.stack([-directions[..., 1], directions[..., 0]], axis=-1)
    t = np.sum(u * ends, axis=-1)
    D = (t[:, 1] - t[:, 0])[:, None]
    along_normal = np.sum(n * directions, axis=-1) * sensor.sigma_range
    across_normal = np.sum(n * across, axis=-1) * ranges * sensor.sigma_bearing
    s2 = along_normal**2 + across_normal**2
    # With errors e_i along the normal, d alpha = (e_0 - e_1) / D, d r = (t_1 e_0 - t_0 e_1) / D
    j = np.stack([np.stack([t[:, 1], -t[:, 0]], -1) / D, np.array([1.0, -1.0]) / D], -1)
    return np.asarray(np.einsum("nia,nib,ni->nab", j, j, s2))


def _end_sigmas(lines: Array, ends: Array, sensor: LineSensor) -> Array:
    """(n, 2) sigma_t^2 = (u . e_r sigma_R)^2 + (u . e_b rho sigma_B)^2."""
    ranges = np.linalg.norm(ends, axis=-1)
    directions = ends / ranges[..., None]
    n = normals(lines[:, 1])[:, None, :]
    u = np.stack([-n[..., 1], n[..., 0]], axis=-1)
    across = np.stack([-directions[..., 1], directions[..., 0]], axis=-1)
    along = np.sum(u * directions, axis=-1) * sensor.sigma_range
    sideways = np.sum(u * across, axis=-1) * ranges * sensor.sigma_bearing
    return np.asarray(np.hypot(along, sideways))


_TURNED_OVER = np.array([[1.0, -1.0], [-1.0, 1.0]])
