"""The one-point solution of planar motion, for any camera mount (paper 1 eqs. (12)-(17), SPEC 1.2).

One matched point fixes the turn theta, and with its disparity the chord rho, of a robot whose
track centre moves without side slip. The paper's eq. (14) holds for a level camera above the
track centre; the form here takes the mount: a forward, b left, and any tilt, roll and yaw.
"""

from dataclasses import dataclass

import numpy as np

from grouser.geometry import Array
from grouser.rig import R_BASE_OPTICAL, StereoCamera


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
        self._level = R_BASE_OPTICAL.T @ camera.T_base_camera[:3, :3]  # Rlc
        self._forward, self._left = camera.T_base_camera[:2, 3]  # a, b
        self._baseline = camera.baseline
        self._f = camera.fx
        # fy may differ from fx: v is scaled so that one focal length serves both.
        self._centre = np.array([camera.cx, camera.cy])
        self._scale = np.array([1.0, camera.fx / camera.fy])

    def level(self, reference: Array, current: Array) -> LevelledPoints:
        """Points (n, 3) u, v, d [px] of the two frames, as the solutions below take them."""
        return LevelledPoints(
            self._rays(reference), reference[:, 2], self._rays(current), current[:, 2]
        )

    def _rays(self, points: Array) -> Array:
        image = (points[:, :2] - self._centre) * self._scale
        rays = np.concatenate([image, np.full((len(points), 1), self._f)], axis=1)
        return np.asarray(rays @ self._level.T)

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
            noise: (n, 6) variances of u, v, d in the reference and the current frame [px^2].
            side: displacement s across the half-angle frame [m], where the path between the frames
                was no single arc. SPEC 1.2 has s = 0; with it, in metric coordinates,
                (x' - x) cos(phi) - s = (z + z' + 2a) sin(phi).
        """
        q, d, q_, d_ = points.q, points.d, points.q_, points.d_
        k1, k2 = self._mix(points)
        m, m_ = k1 * q[:, 1] + k2 * d, k1 * q_[:, 1] + k2 * d_
        lever = self._forward / self._baseline
        top = q_[:, 0] * m - q[:, 0] * m_
        bottom = q[:, 2] * m_ + q_[:, 2] * m + lever * (m * d_ + m_ * d)
        # d(phi) = (bottom d(top) - top d(bottom)) / (top^2 + bottom^2), with k1 and k2 held fixed.
        norm = top**2 + bottom**2
        along, across = bottom / norm, -top / norm
        by_m = along * q_[:, 0] + across * (q_[:, 2] + lever * d_)
        by_m_ = -along * q[:, 0] + across * (q[:, 2] + lever * d)
        by_q = np.stack([-along * m_, k1 * by_m, across * m_], axis=1)
        by_q_ = np.stack([along * m, k1 * by_m_, across * m], axis=1)
        by_d = k2 * by_m + across * lever * m_
        by_d_ = k2 * by_m_ + across * lever * m
        variance = self._variance(points, by_q, by_d, by_q_, by_d_, noise, tolerance)
        # A quarter turn between frames is out of reach, so the sign of the fraction's parts is free
        phi = np.arctan(top / bottom)
        if side:
            # |(x' - x, z + z' + 2a)|, whose inverse stays finite at d = 0
            closeness = np.abs(m * m_) * (d + d_) / (self._baseline * np.abs(m + m_))
            phi = phi - np.arcsin(np.clip(side * closeness / np.sqrt(norm), -1, 1))
        return 2 * phi, 2 * np.sqrt(variance)

    def chords(
        self, points: LevelledPoints, turn: float, noise: Array, tolerance: ChassisTolerance
    ) -> tuple[Array, Array]:
        """rho (n,) [m] from each point, given the common turn [rad], and its sigma (n,)."""
        q, d, q_, d_ = points.q, points.d, points.q_, points.d_
        k1, k2 = self._mix(points)
        s, c = np.sin(turn / 2), np.cos(turn / 2)
        m, m_ = k1 * q[:, 1] + k2 * d, k1 * q_[:, 1] + k2 * d_
        g = self._baseline * (m + m_) / (d + d_)  # range scale: P = (g / m) q
        along, along_ = -q[:, 0] * s + q[:, 2] * c, q_[:, 0] * s + q_[:, 2] * c
        depth, depth_ = g * along / m, g * along_ / m_
        chord = depth - depth_ + 2 * self._left * s
        difference = depth - depth_
        by_m = -depth / m + difference / (m + m_)
        by_m_ = depth_ / m_ + difference / (m + m_)
        zero = np.zeros_like(d)
        by_q = np.stack([-g / m * s, k1 * by_m, g / m * c + zero], axis=1)
        by_q_ = np.stack([-g / m_ * s, k1 * by_m_, -g / m_ * c + zero], axis=1)
        by_d = k2 * by_m - difference / (d + d_)
        by_d_ = k2 * by_m_ - difference / (d + d_)
        variance = self._variance(points, by_q, by_d, by_q_, by_d_, noise, tolerance)
        return chord, np.sqrt(variance)

    def _mix(self, points: LevelledPoints) -> tuple[Array, Array]:
        """Weights k1, k2 (n,) of the least-variance m = k1 q_y + k2 d (SPEC 1.2)."""
        return (points.q[:, 1] + points.q_[:, 1]) / 2, (points.d + points.d_) / 4

    def _variance(
        self,
        points: LevelledPoints,
        by_q: Array,
        by_d: Array,
        by_q_: Array,
        by_d_: Array,
        noise: Array,
        tolerance: ChassisTolerance,
    ) -> Array:
        """Variance (n,) of a function with these derivatives, from pixels and from the chassis."""
        q_, d_ = points.q_, points.d_
        by_pixel = np.column_stack([(by_q @ self._level[:, :2]) * self._scale, by_d])
        by_pixel_ = np.column_stack([(by_q_ @ self._level[:, :2]) * self._scale, by_d_])
        variance = (by_pixel**2 * noise[:, :3]).sum(axis=1)
        variance += (by_pixel_**2 * noise[:, 3:]).sum(axis=1)
        by_pitch = by_q_[:, 1] * q_[:, 2] - by_q_[:, 2] * q_[:, 1]
        by_roll = by_q_[:, 1] * q_[:, 0] - by_q_[:, 0] * q_[:, 1]
        by_height = by_q_[:, 1] * d_ / self._baseline
        variance += (by_pitch * tolerance.pitch) ** 2 + (by_roll * tolerance.roll) ** 2
        return np.asarray(variance + (by_height * tolerance.height) ** 2)
