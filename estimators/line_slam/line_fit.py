"""The line that returns of a lidar are most likely to be of: SPEC 2.5, step 3.

(Pfister, Roumeliotis and Burdick, "Weighted line fitting algorithms for mobile robot map building
and efficient data representation", ICRA 2003.)
"""

import math

import numpy as np

from grouser.geometry import Array
from grouser.kernels import kernel

_STEPS = 3


@kernel
def total_least_squares(points: Array) -> tuple[float, float]:
    """(r, alpha) of the line with the least squared distances to points (m, 2)."""
    x, y = points[:, 0].mean(), points[:, 1].mean()
    xy, xx_yy = 0.0, 0.0
    for i in range(len(points)):
        dx, dy = points[i, 0] - x, points[i, 1] - y
        xy += dx * dy
        xx_yy += dy * dy - dx * dx
    alpha = 0.5 * math.atan2(-2 * xy, xx_yy)
    return x * math.cos(alpha) + y * math.sin(alpha), alpha


@kernel
def squared_sigmas_off(
    point: Array, by_range: Array, by_bearing: Array, r: float, alpha: float
) -> float:
    """Squared distance of a return from a line, over its variance across the line.

    Args:
        point: (2,) m.
        by_range, by_bearing: (2,) how far one sigma of its range and of its bearing move it, m.
    """
    c, s = math.cos(alpha), math.sin(alpha)
    off = c * point[0] + s * point[1] - r
    of_range = c * by_range[0] + s * by_range[1]
    of_bearing = c * by_bearing[0] + s * by_bearing[1]
    return float(off * off / (of_range * of_range + of_bearing * of_bearing))


@kernel
def fit_line(points: Array, by_range: Array, by_bearing: Array) -> tuple[Array, Array, float]:
    """((2,) r and alpha, (2, 2) their covariance, chi2) of the line through returns (m, 2), m >= 2.

    The noise of ranges and bearings moves a return across the line by a variance that depends on
    the line, v_i; each of the Gauss-Newton steps takes that of the line found so far.
    """
    r, alpha = total_least_squares(points)
    for _ in range(_STEPS):
        A00, A01, A11, b0, b1 = _normal_equations(points, by_range, by_bearing, alpha)
        determinant = A00 * A11 - A01 * A01
        r = (A11 * b0 - A01 * b1) / determinant
        alpha += (A00 * b1 - A01 * b0) / determinant
    A00, A01, A11, b0, b1 = _normal_equations(points, by_range, by_bearing, alpha)
    determinant = A00 * A11 - A01 * A01
    line, covariance = np.empty(2), np.empty((2, 2))
    covariance[0, 0], covariance[1, 1] = A11 / determinant, A00 / determinant
    covariance[0, 1] = covariance[1, 0] = -A01 / determinant
    line[0], line[1] = r, alpha
    chi2 = 0.0
    for i in range(len(points)):
        chi2 += squared_sigmas_off(points[i], by_range[i], by_bearing[i], r, alpha)
    return line, covariance, chi2


@kernel
def _normal_equations(
    points: Array, by_range: Array, by_bearing: Array, alpha: float
) -> tuple[float, float, float, float, float]:
    """Of r and of the change of alpha: A00, A01, A11, b0, b1."""
    c, s = math.cos(alpha), math.sin(alpha)
    A00, A01, A11, b0, b1 = 0.0, 0.0, 0.0, 0.0, 0.0
    for i in range(len(points)):
        p = c * points[i, 0] + s * points[i, 1]
        t = c * points[i, 1] - s * points[i, 0]
        of_range = c * by_range[i, 0] + s * by_range[i, 1]
        of_bearing = c * by_bearing[i, 0] + s * by_bearing[i, 1]
        w = 1 / (of_range * of_range + of_bearing * of_bearing)
        A00 += w
        A01 -= w * t
        A11 += w * t * t
        b0 += w * p
        b1 -= w * t * p
    return A00, A01, A11, b0, b1
