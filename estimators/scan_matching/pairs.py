"""Points of a scan and what they are taken for in the reference."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from grouser.estimators.scan_matching.nearest_field import nearest_to
from grouser.estimators.scan_matching.reference import Reference
from grouser.estimators.scan_matching.shared_lines import line_at
from grouser.estimators.scan_matching.surface import Surface
from grouser.geometry import Array
from grouser.kernels import kernel, kernel_using


class Pairs(NamedTuple):
    """What each of a scan's m points is taken for, and how far it is off."""

    scans: NDArray[np.int32]
    """(m,) of which scan of the reference that is; -1 where there is nothing"""
    weights: Array
    """(m,) Cauchy's; 0 where there is nothing"""
    on_line: NDArray[np.bool_]
    """(m,) whether both lie on lines that face alike: then the distance across tells, else both
    coordinates do, less surely."""
    off: Array
    """(m, 2) m; the first is the distance where it is on a line, and the second zero"""
    by_pose: Array
    """(m, 2, 3) their derivatives by the pose"""
    along: Array
    """(m, 3) derivative by the pose of how far it is along its line, times the sigma of the line's
    direction; zero where there is no line"""


@kernel
def no_pairs(m: int) -> Pairs:
    """Room for those of m points."""
    return Pairs(
        np.full(m, -1, dtype=np.int32),
        np.zeros(m),
        np.zeros(m, dtype=np.bool_),
        np.zeros((m, 2)),
        np.zeros((m, 2, 3)),
        np.zeros((m, 3)),
    )


@kernel_using(nearest_to, line_at)
def pair(
    surface: Surface,
    reference: Reference,
    pose: Array,
    radius: float,
    cauchy: float,
    same_side: float,
    pairs: Pairs,
) -> None:
    """Write, for a scan at a pose, the pairs that are no farther apart than the radius [m]."""
    points, _, normals, sigmas, _ = surface
    # Feet: of many points on a wall, noise brings one nearest to where it is looked for.
    _, q, n, n_sigmas, _ = reference.surface
    c, s = np.cos(pose[2]), np.sin(pose[2])
    for k in range(len(points)):
        pairs.scans[k], pairs.weights[k], pairs.on_line[k] = -1, 0.0, False
        pairs.along[k] = 0.0
        # The lever from the scan's origin to the point, in the reference's frame.
        lx, ly = c * points[k, 0] - s * points[k, 1], s * points[k, 0] + c * points[k, 1]
        x, y = pose[0] + lx, pose[1] + ly
        i = nearest_to(reference.field, x, y)
        # What has no neighbours may lie anywhere along a wall that the beams hardly meet.
        if i < 0 or np.isnan(sigmas[k]) or np.isnan(n_sigmas[i]):
            continue
        qx, qy, nx, ny = q[i, 0], q[i, 1], n[i, 0], n[i, 1]
        n_sigma = n_sigmas[i]  # as rough as it is, for all scans alike: their mean is no surer
        if np.isfinite(n_sigma):
            line = line_at(reference.surface, reference.shared, i)
            qx, qy, nx, ny = line[0], line[1], line[2], line[3]
        dx, dy = x - qx, y - qy
        if dx * dx + dy * dy > radius * radius:
            continue
        mx, my = c * normals[k, 0] - s * normals[k, 1], s * normals[k, 0] + c * normals[k, 1]
        facing = nx * mx + ny * my
        if facing < -same_side:
            continue  # the other side of a thin wall
        pairs.scans[k] = reference.scans[i]
        J = pairs.by_pose[k]
        if facing > same_side and np.isfinite(sigmas[k]) and np.isfinite(n_sigma):
            pairs.on_line[k] = True
            pairs.off[k, 0], pairs.off[k, 1] = nx * dx + ny * dy, 0.0
            J[0, 0], J[0, 1], J[0, 2] = nx, ny, ny * lx - nx * ly
            J[1] = 0.0
            pairs.along[k, 0], pairs.along[k, 1] = -n_sigma * ny, n_sigma * nx
            pairs.along[k, 2] = n_sigma * (nx * lx + ny * ly)
        else:
            pairs.off[k, 0], pairs.off[k, 1] = dx, dy
            J[0, 0], J[0, 1], J[0, 2] = 1.0, 0.0, -ly
            J[1, 0], J[1, 1], J[1, 2] = 0.0, 1.0, lx
        pairs.weights[k] = 1 / (1 + _square(pairs, k) / cauchy**2)


@kernel
def variance(pairs: Pairs, on_line: bool, cauchy: float, least: float) -> float:
    """Of the distances of points on lines, or of the coordinates of the others [m^2].

    As Huber's M-estimators have it, by psi(r) = w r and its derivative: so weights that shrink
    what is far off do not make the pose seem surer. Not below `least`.
    """
    total, squares, slope = 0.0, 0.0, 0.0
    for k in range(len(pairs.weights)):
        w = pairs.weights[k]
        if w > 0.0 and pairs.on_line[k] == on_line:
            square = _square(pairs, k)
            total += w
            squares += w * w * square
            slope += w * w * (1 - square / cauchy**2)
    slope = max(slope - 3.0, 0.1 * total, 1.0)
    return max(least, total * squares / (slope * slope) / (1.0 if on_line else 2.0))


@kernel
def normal_equations(pairs: Pairs, variances: Array) -> tuple[Array, Array, Array]:
    """(A, S, b): information on the pose, that part of it which noise in the normals only makes
    up, on average, and the gradient; points off lines and on lines have the variances (2,)."""
    A, S, b = np.zeros((3, 3)), np.zeros((3, 3)), np.zeros(3)
    for k in range(len(pairs.weights)):
        if pairs.weights[k] == 0.0:
            continue
        w = pairs.weights[k] / variances[int(pairs.on_line[k])]
        J, off, along = pairs.by_pose[k], pairs.off[k], pairs.along[k]
        for i in range(3):
            b[i] -= w * (J[0, i] * off[0] + J[1, i] * off[1])
            for j in range(3):
                A[i, j] += w * (J[0, i] * J[0, j] + J[1, i] * J[1, j])
                S[i, j] += w * along[i] * along[j]
    return A, S, b


@kernel
def information_by_scan(pairs: Pairs, variances: Array, by_scan: Array) -> None:
    """Add, to (k, 3, 3) zeros, A of `normal_equations` scan by scan of the reference."""
    for k in range(len(pairs.weights)):
        if pairs.weights[k] == 0.0:
            continue
        w = pairs.weights[k] / variances[int(pairs.on_line[k])]
        J = pairs.by_pose[k]
        for i in range(3):
            for j in range(3):
                by_scan[pairs.scans[k], i, j] += w * (J[0, i] * J[0, j] + J[1, i] * J[1, j])


@kernel
def independent_share(pairs: Pairs, variances: Array) -> float:
    """How many independent points tell as much as these, as a share of them: one over
    1 + 2 (rho_1 + rho_2 + ...), rho_l the correlation of what points l beams apart are off, which
    rough surfaces and drift within the reference make; summed until it is below noise."""
    n, times, squares, count = len(pairs.weights), 1.0, 0.0, 0
    for k in range(n):
        if pairs.weights[k] > 0.0:
            # What lies closer than its variance has is off by chance, not alike.
            usual = variances[1] if pairs.on_line[k] else 2 * variances[0]
            squares += pairs.weights[k] * max(usual, _square(pairs, k))
            count += 1
    if count == 0:
        return 1.0
    for lag in range(1, _LAGS + 1):
        product = 0.0
        for k in range(lag, n):
            before, now = pairs.off[k - lag], pairs.off[k]
            if pairs.on_line[k] == pairs.on_line[k - lag]:
                w = np.sqrt(pairs.weights[k] * pairs.weights[k - lag])
                product += w * (before[0] * now[0] + before[1] * now[1])
        correlation = product / squares
        if correlation < 2 / np.sqrt(count):
            break
        times += 2 * correlation
    return float(1 / times)


@kernel
def _square(pairs: Pairs, k: int) -> float:
    return float(pairs.off[k, 0] ** 2 + pairs.off[k, 1] ** 2)


_LAGS = 20
"""Beams over which what points are off may be alike"""
