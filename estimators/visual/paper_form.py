"""Paper 1 as it is printed, where it can be computed: so that what SPEC changes can be measured.

Motion is planar and non-holonomic by law, from frame to frame; turn and chord come from single
points by eqs. (14) and (17), the best of some hypotheses wins by its number of inliers under
eqs. (20) and (21) with fixed thresholds. The camera sits on the track centre: a = b = 0.
The paper leaves thresholds and numbers open; those here are ours.
"""

import dataclasses
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from grouser.estimators.visual.matching import Matches
from grouser.estimators.visual.planar import LevelledPoints, PlanarSolver
from grouser.estimators.visual.prior import MotionPrior
from grouser.estimators.visual.solver import Hypothesis, MotionSolver
from grouser.estimators.visual.turn_errors import TURN_ERRORS
from grouser.geometry import Array, transform
from grouser.rig import R_BASE_OPTICAL, StereoCamera

MOST_POINTS = 64
"""Matches that the paper uses in one frame."""
_CHOICES = {
    "chord_sign": ("fixed", "printed"),
    "turn_error": tuple(TURN_ERRORS),
    "mount": ("levelled", "ignored", "known"),
}


@dataclass(frozen=True, slots=True)
class PaperForm:
    """What the paper prints, what it leaves open, and its two mistakes that stop it."""

    chord_sign: Literal["fixed", "printed"] = "fixed"
    """The sign between the two terms of eqs. (16) and (17): printed plus, minus is right."""
    turn_error: Literal["sampson", "ratio"] = "sampson"
    """What is held against th_yaw_angle: the Sampson error, or as printed, eq. (20)."""
    mount: Literal["levelled", "ignored", "known"] = "levelled"
    """What of the mount is taken out: its tilt, nothing, or its place on the robot as well."""
    hypotheses: int = 16
    """Points that are drawn for the turn, and again for the chord."""
    yaw_angle: float | None = None
    """th_yaw_angle, px of the Sampson error or a number for eq. (20); None as `TURN_ERRORS` has."""
    polar_radius: float = 0.2
    """m: th_polar_radius of eq. (21)"""

    def __post_init__(self) -> None:
        for name, known in _CHOICES.items():
            if getattr(self, name) not in known:
                allowed = ", ".join(map(repr, known))
                raise ValueError(f"{name} must be one of {allowed}, got {getattr(self, name)!r}")
        for name in ("hypotheses", "yaw_angle", "polar_radius"):
            value = getattr(self, name)
            if value is not None and not value > 0:
                raise ValueError(f"{name} must be positive, got {value!r}")

    def camera(self, camera: StereoCamera) -> StereoCamera:
        """The camera as it is taken to be mounted."""
        if self.mount == "known":
            return camera
        rotation = camera.T_base_camera[:3, :3] if self.mount == "levelled" else R_BASE_OPTICAL
        height = [0.0, 0.0, camera.T_base_camera[2, 3]]
        return dataclasses.replace(camera, T_base_camera=transform(rotation, height))


class PaperOnePoint(MotionSolver):
    """Turn first, then chord among the points that agree on the turn, by counting inliers."""

    def __init__(self, camera: StereoCamera, form: PaperForm) -> None:
        """camera: mounted as `form.camera` has it."""
        self._solver = PlanarSolver(camera)
        self._baseline = camera.baseline
        forward, left = camera.T_base_camera[:2, 3]
        self._lever = np.array([-left, 0.0, forward]) / camera.baseline
        self._form = form

    def solve(
        self, matches: Matches, prior: MotionPrior, rng: np.random.Generator
    ) -> Hypothesis | None:
        """Nothing of the prior is used: a law has no sigma."""
        form = self._form
        points = self._from_track_centre(self._solver.level(matches.reference, matches.current))
        turns = turns_of_points(points)
        drawn = _draw(np.isfinite(turns), form.hypotheses, rng)
        if len(drawn) == 0:
            return None
        turn_errors, limit = TURN_ERRORS[form.turn_error]
        agree = turn_errors(points, turns[drawn], 0.0) < (form.yaw_angle or limit)
        best = int(np.argmax(agree.sum(axis=1)))
        turn, agree = float(turns[drawn[best]]), agree[best]
        chords = chords_of_points(points, turn, self._baseline, form.chord_sign)
        drawn_ = _draw(agree & np.isfinite(chords), form.hypotheses, rng)
        if len(drawn_) == 0:
            return None
        errors = chord_errors(points, turn, chords[drawn_], self._baseline)
        inliers = agree & (errors < form.polar_radius)
        best = int(np.argmax(inliers.sum(axis=1)))
        motion = np.array([turn, chords[drawn_[best]], 0.0, 0.0, 0.0, 0.0])
        return Hypothesis(motion, inliers[best], len(drawn) + len(drawn_))

    def _from_track_centre(self, points: LevelledPoints) -> LevelledPoints:
        """As a camera on the track centre would see them, for which the equations hold."""
        q, d, q_, d_ = points.q, points.d, points.q_, points.d_
        return LevelledPoints(q + d[:, None] * self._lever, d, q_ + d_[:, None] * self._lever, d_)


def turns_of_points(points: LevelledPoints) -> Array:
    """theta (n,) [rad], eq. (14) (eq. (12) where the camera is tilted); NaN at the horizon."""
    q, q_ = points.q, points.q_
    with np.errstate(divide="ignore", invalid="ignore"):
        tangent = (q_[:, 0] * q[:, 1] - q[:, 0] * q_[:, 1]) / (
            q[:, 1] * q_[:, 2] + q_[:, 1] * q[:, 2]
        )
    return np.asarray(2 * np.arctan(np.where(np.isfinite(tangent), tangent, np.nan)))


def chords_of_points(
    points: LevelledPoints, turn: float, baseline: float, sign: Literal["fixed", "printed"]
) -> Array:
    """rho (n,) [m], eq. (17), with the sign as printed (+) or right (-); NaN at infinity."""
    s, c = np.sin(turn / 2), np.cos(turn / 2)
    before, after = metric(points, baseline)
    along = -s * before[:, 0] + c * before[:, 2]
    along_ = s * after[:, 0] + c * after[:, 2]
    return np.asarray(along + along_ if sign == "printed" else along - along_)


def chord_errors(points: LevelledPoints, turn: float, chords: Array, baseline: float) -> Array:
    """(k, n) [m] distance of the points from where a motion takes them, eq. (21)."""
    before, after = metric(points, baseline)
    c, s = np.cos(turn), np.sin(turn)
    R = np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])
    along = np.array([np.sin(turn / 2), 0.0, np.cos(turn / 2)])
    still = after - before @ R.T
    return np.asarray(np.linalg.norm(still + chords[:, None, None] * along, axis=-1))


def metric(points: LevelledPoints, baseline: float) -> tuple[Array, Array]:
    """The points (n, 3) [m] before and after, eq. (13); NaN without disparity."""
    d, d_ = (np.where(part > 0, part, np.nan)[:, None] for part in (points.d, points.d_))
    return baseline / d * points.q, baseline / d_ * points.q_


def _draw(usable: NDArray[np.bool_], number: int, rng: np.random.Generator) -> NDArray[np.intp]:
    """Indices of so many different points, or of all where there are fewer."""
    indices = np.flatnonzero(usable)
    return rng.choice(indices, min(number, len(indices)), replace=False)
