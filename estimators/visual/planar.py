"""The one-point solution of planar motion, for any camera mount (paper 1 eqs. (12)-(17), SPEC 1.2).

One matched point fixes the turn theta, and with its disparity the chord rho, of a robot whose
track centre moves without side slip. The paper's eq. (14) holds for a level camera above the
track centre; the form here takes the mount: a forward, b left, and any tilt, roll and yaw.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from grouser.geometry import Array
from grouser.kernels import kernel
from grouser.rig import R_BASE_OPTICAL, StereoCamera

Slack = tuple[float, float, float]
"""Roll, pitch [rad] and height [m] of a `ChassisTolerance`, as the kernels take them."""
Mount = tuple[tuple[float, float, float, float], Array]
"""Forward, left, baseline [m] and fx / fy of a camera, and Rlc (3, 3), as the kernels take them."""


@dataclass(frozen=True, slots=True)
class ChassisTolerance:
    """How far one increment may leave the plane: one sigma of what the solution does not model."""

    roll: float = 0.0
    """rad"""
    pitch: float = 0.0
    """rad"""
    height: float = 0.0
    """m"""


@dataclass(frozen=True, slots=True)
class LevelledPoints:
    """Matched points in the levelled camera frames (x right, y down, z forward)."""

    q: Array
    """(n, 3) Rlc (U, V, f) in the reference frame, px"""
    d: Array
    """(n,) disparity, px"""
    q_: Array
    """(n, 3) the same in the current frame"""
    d_: Array


class PlanarSolver:
    """Turn and chord from each matched point, with their sigmas, for one camera and mount."""

    def __init__(self, camera: StereoCamera) -> None:
        level = R_BASE_OPTICAL.T @ camera.T_base_camera[:3, :3]  # Rlc
        # fy may differ from fx: v is scaled so that one focal length serves both.
        aspect = camera.fx / camera.fy
        forward, left = map(float, camera.T_base_camera[:2, 3])  # a, b
        self._mount = ((forward, left, camera.baseline, aspect), np.ascontiguousarray(level))
        self._intrinsics = (camera.fx, camera.cx, camera.cy)

    def level(self, reference: Array, current: Array) -> LevelledPoints:
        """Points (n, 3) u, v, d [px] of the two frames, as the solutions below take them."""
        q, d = _rays(reference, self._intrinsics, self._mount)
        q_, d_ = _rays(current, self._intrinsics, self._mount)
        return LevelledPoints(q, d, q_, d_)

    def turns(
        self,
        points: LevelledPoints,
        noise: Array,
        tolerance: ChassisTolerance,
        *,
        side: float = 0.0,
    ) -> tuple[Array, Array]:
        """theta (n,) [rad] from each point and its sigma (n,) (SPEC 1.2, 1.4).

        Args:
            noise: (n, 6), or (1, 6) for all points, variances of u, v, d in the reference and the
                current frame [px^2].
            side: displacement s across the half-angle frame [m], where the path between the frames
                was no single arc. SPEC 1.2 has s = 0; with it, in metric coordinates,
                (x' - x) cos(phi) - s = (z + z' + 2a) sin(phi).
        """
        return self._each(_turns, side, points, noise, tolerance)

    def chords(
        self, points: LevelledPoints, turn: float, noise: Array, tolerance: ChassisTolerance
    ) -> tuple[Array, Array]:
        """rho (n,) [m] from each point, given the common turn [rad], and its sigma (n,)."""
        return self._each(_chords, turn, points, noise, tolerance)

    def _each(
        self,
        solve: Callable[..., tuple[Array, Array]],
        given: float,
        points: LevelledPoints,
        noise: Array,
        tolerance: ChassisTolerance,
    ) -> tuple[Array, Array]:
        if len(noise) != len(points.d):
            noise = np.tile(noise, (len(points.d), 1))
        slack = (tolerance.roll, tolerance.pitch, tolerance.height)
        return solve(points.q, points.d, points.q_, points.d_, noise, slack, self._mount, given)


@kernel
def _rays(
    points: Array, intrinsics: tuple[float, float, float], mount: Mount
) -> tuple[Array, Array]:
    """Rlc (U, V, f) (n, 3) and disparity (n,) of points (n, 3)."""
    (_, _, _, aspect), level = mount
    f, cx, cy = intrinsics
    rays, d = np.empty((len(points), 3)), np.empty(len(points))
    for i in range(len(points)):
        U, V = points[i, 0] - cx, (points[i, 1] - cy) * aspect
        for k in range(3):
            rays[i, k] = level[k, 0] * U + level[k, 1] * V + level[k, 2] * f
        d[i] = points[i, 2]
    return rays, d


@kernel
def _turns(
    q: Array,
    d: Array,
    q_: Array,
    d_: Array,
    noise: Array,
    slack: Slack,
    mount: Mount,
    side: float,
) -> tuple[Array, Array]:
    """theta and its sigma of every point (SPEC 1.2)."""
    forward, _, baseline, _ = mount[0]
    lever = forward / baseline
    turns, sigmas = np.empty(len(d)), np.empty(len(d))
    by_q, by_q_ = np.empty(3), np.empty(3)
    for i in range(len(d)):
        k1, k2 = _mix(q[i, 1], d[i], q_[i, 1], d_[i])
        m, m_ = k1 * q[i, 1] + k2 * d[i], k1 * q_[i, 1] + k2 * d_[i]
        top = q_[i, 0] * m - q[i, 0] * m_
        bottom = q[i, 2] * m_ + q_[i, 2] * m + lever * (m * d_[i] + m_ * d[i])
        # d(phi) = (bottom d(top) - top d(bottom)) / (top^2 + bottom^2), with k1 and k2 held fixed.
        norm = top**2 + bottom**2
        along, across = bottom / norm, -top / norm
        by_m = along * q_[i, 0] + across * (q_[i, 2] + lever * d_[i])
        by_m_ = -along * q[i, 0] + across * (q[i, 2] + lever * d[i])
        by_q[0], by_q[1], by_q[2] = -along * m_, k1 * by_m, across * m_
        by_q_[0], by_q_[1], by_q_[2] = along * m, k1 * by_m_, across * m
        by_d, by_d_ = k2 * by_m + across * lever * m_, k2 * by_m_ + across * lever * m
        variance = _variance(by_q, by_d, by_q_, by_d_, q_[i], d_[i], noise[i], slack, mount)
        # A quarter turn between frames is out of reach, so the sign of the fraction's parts is free
        phi = np.arctan(top / bottom)
        if side != 0.0:
            # |(x' - x, z + z' + 2a)|, whose inverse stays finite at d = 0
            closeness = abs(m * m_) * (d[i] + d_[i]) / (baseline * abs(m + m_))
            phi -= np.arcsin(min(max(side * closeness / np.sqrt(norm), -1.0), 1.0))
        turns[i], sigmas[i] = 2 * phi, 2 * np.sqrt(variance)
    return turns, sigmas


@kernel
def _chords(
    q: Array,
    d: Array,
    q_: Array,
    d_: Array,
    noise: Array,
    slack: Slack,
    mount: Mount,
    turn: float,
) -> tuple[Array, Array]:
    """rho and its sigma of every point (SPEC 1.2)."""
    _, left, baseline, _ = mount[0]
    s, c = np.sin(turn / 2), np.cos(turn / 2)
    chords, sigmas = np.empty(len(d)), np.empty(len(d))
    by_q, by_q_ = np.empty(3), np.empty(3)
    for i in range(len(d)):
        k1, k2 = _mix(q[i, 1], d[i], q_[i, 1], d_[i])
        m, m_ = k1 * q[i, 1] + k2 * d[i], k1 * q_[i, 1] + k2 * d_[i]
        both = d[i] + d_[i]
        g = baseline * (m + m_) / both  # range scale: P = (g / m) q
        depth = g * (-q[i, 0] * s + q[i, 2] * c) / m
        depth_ = g * (q_[i, 0] * s + q_[i, 2] * c) / m_
        difference = depth - depth_
        by_m, by_m_ = -depth / m + difference / (m + m_), depth_ / m_ + difference / (m + m_)
        by_q[0], by_q[1], by_q[2] = -g / m * s, k1 * by_m, g / m * c
        by_q_[0], by_q_[1], by_q_[2] = -g / m_ * s, k1 * by_m_, -g / m_ * c
        by_d, by_d_ = k2 * by_m - difference / both, k2 * by_m_ - difference / both
        variance = _variance(by_q, by_d, by_q_, by_d_, q_[i], d_[i], noise[i], slack, mount)
        chords[i], sigmas[i] = difference + 2 * left * s, np.sqrt(variance)
    return chords, sigmas


@kernel
def _mix(y: float, d: float, y_: float, d_: float) -> tuple[float, float]:
    """Weights k1, k2 of the least-variance m = k1 q_y + k2 d (SPEC 1.2)."""
    return (y + y_) / 2, (d + d_) / 4


@kernel
def _variance(
    by_q: Array,
    by_d: float,
    by_q_: Array,
    by_d_: float,
    q_: Array,
    d_: float,
    noise: Array,
    slack: Slack,
    mount: Mount,
) -> float:
    """Variance of a function with these derivatives, from pixels and from the chassis."""
    (_, _, baseline, aspect), level = mount
    by_u = by_q[0] * level[0, 0] + by_q[1] * level[1, 0] + by_q[2] * level[2, 0]
    by_v = by_q[0] * level[0, 1] + by_q[1] * level[1, 1] + by_q[2] * level[2, 1]
    by_u_ = by_q_[0] * level[0, 0] + by_q_[1] * level[1, 0] + by_q_[2] * level[2, 0]
    by_v_ = by_q_[0] * level[0, 1] + by_q_[1] * level[1, 1] + by_q_[2] * level[2, 1]
    variance = by_u**2 * noise[0] + (by_v * aspect) ** 2 * noise[1] + by_d**2 * noise[2]
    variance += by_u_**2 * noise[3] + (by_v_ * aspect) ** 2 * noise[4] + by_d_**2 * noise[5]
    roll, pitch, height = slack
    variance += ((by_q_[1] * q_[2] - by_q_[2] * q_[1]) * pitch) ** 2
    variance += ((by_q_[1] * q_[0] - by_q_[0] * q_[1]) * roll) ** 2
    return float(variance + (by_q_[1] * d_ / baseline * height) ** 2)
