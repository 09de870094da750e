"""What the paper prints of vision, eqs. (12) to (21), against what is right (SPEC 1.1 to 1.4).

Everything is measured on synthetic points: `printed` is the equation as it stands in the paper,
`corrected` this repository's own solver where it has one.
"""

import numpy as np

from grouser.estimators.visual.planar import ChassisTolerance, LevelledPoints, PlanarSolver
from grouser.geometry import Array
from grouser.rig import StereoCamera
from grouser.scripts.reproduction.zhao.synthetic import (
    SIGMA_PX,
    at_pixels,
    moved,
    noisy,
    planar,
    scattered,
    seen,
    spec_camera,
)

MOTIONS = ((0.06, 0.12), (-0.4, 0.5), (0.0, 0.1), (0.05, -0.15), (0.2, 0.0), (-0.02, 0.05))
"""Turn [rad] and chord [m]: arcs to either side, straight on, reverse, on the spot."""

_LEVEL = ChassisTolerance()
_USUAL_DEPTH = 3.2  # m


def turn_of_points(P: Array, P_: Array) -> Array:
    """phi (n,) by eq. (12) of points (n, 3) [m] in the two frames."""
    (x, y, z), (x_, y_, z_) = P.T, P_.T
    return np.asarray(np.arctan((x_ * y - x * y_) / (y * z_ + y_ * z)))


def turn_of_pixels(w: Array, w_: Array, camera: StereoCamera) -> Array:
    """phi (n,) by eq. (14) of u, v, d (n, 3)."""
    (U, V), (U_, V_) = _centred(w, camera), _centred(w_, camera)
    return np.asarray(np.arctan((U_ * V - U * V_) / (camera.fx * (V + V_))))


def chord_of_points(P: Array, P_: Array, phi: float, *, sign: float) -> Array:
    """rho (n,) by eqs. (16) and (17): the paper adds the second term (sign 1), -1 is right."""
    before = -P[:, 0] * np.sin(phi) + P[:, 2] * np.cos(phi)
    after = P_[:, 0] * np.sin(phi) + P_[:, 2] * np.cos(phi)
    return np.asarray(before + sign * after)


def ratio_error(w: Array, w_: Array, phi: float, camera: StereoCamera) -> Array:
    """error_theta (n,) by eq. (20), of u, v, d (n, 3)."""
    (U, V), (U_, V_) = _centred(w, camera), _centred(w_, camera)
    f = camera.fx
    tan_alpha, tan_alpha_ = V / np.hypot(U, f), V_ / np.hypot(U_, f)
    sin_gamma = np.sin(np.arctan2(U, f) + phi)
    sin_gamma_ = np.sin(np.arctan2(U_, f) - phi)
    return np.asarray(np.abs(tan_alpha_ / tan_alpha - sin_gamma_ / sin_gamma))


def sampson_error(w: Array, w_: Array, phi: float, camera: StereoCamera) -> Array:
    """The same as a distance in the images, px (SPEC 1.3)."""
    (U, V), (U_, V_) = _centred(w, camera), _centred(w_, camera)
    c, s = np.cos(phi), np.sin(phi)
    along, along_ = U * c + camera.fx * s, U_ * c - camera.fx * s
    gradient = np.sqrt((V_ * c) ** 2 + along_**2 + (V * c) ** 2 + along**2)
    return np.asarray(np.abs(V_ * along - V * along_) / gradient)


def turn_errors(rng: np.random.Generator) -> dict[str, float]:
    """Largest error of (12) and (14) on exact points, and of (14) for a camera ahead of the track
    centre, rad; the corrected form knows where the camera is."""
    level, ahead = spec_camera(), spec_camera(0.2)
    by_12, by_14, by_14_at_infinity, corrected = 0.0, 0.0, 0.0, 0.0
    for turn, chord in MOTIONS:
        P, P_, w, w_ = _pair(rng, level, turn, chord)
        by_12 = max(by_12, _largest(turn_of_points(P, P_) - turn / 2))
        by_14 = max(by_14, _largest(turn_of_pixels(w, w_, level) - turn / 2))
        far = 1e9 * P
        w, w_ = seen(far, level), seen(moved(far, planar(turn, 0.0), level), level)
        error = turn_of_pixels(w, w_, level) - turn / 2
        by_14_at_infinity = max(by_14_at_infinity, _largest(error))
        _, _, w, w_ = _pair(rng, ahead, turn, chord)
        corrected = max(corrected, _largest(_turns(w, w_, ahead)[0] - turn))
    return {
        "eq12.error_rad": by_12,
        "eq14.error_rad": by_14,
        "eq14.at_infinity_rad": by_14_at_infinity,
        "eq14.offset_corrected_rad": corrected,
    }


def offset_error(rng: np.random.Generator) -> dict[str, float]:
    """By how much (14) over-estimates a turn on the spot at 2 m depth, 0.2 m ahead, percent."""
    camera, turn, depth = spec_camera(0.2), 0.05, 2.0
    points = scattered(rng, 200, camera)
    points *= depth / points[:, 2:]
    w, w_ = seen(points, camera), seen(moved(points, planar(turn, 0.0), camera), camera)
    off = np.median(turn_of_pixels(w, w_, camera) / (turn / 2) - 1)
    right = np.median(_turns(w, w_, camera)[0] / turn - 1)
    return {"offset.printed_percent": 100 * float(off), "offset.corrected_percent": 100 * right}


def turn_noise(rng: np.random.Generator, runs: int) -> dict[str, float]:
    """Sigma of the turn from one point 3 px below the horizon, 2 m away, deg."""
    camera = spec_camera()
    w, w_ = _measured(rng, 100 * runs, camera, (100.0, 3.0), 2.0, 0.0, 0.0)
    printed = 2 * turn_of_pixels(w, w_, camera)
    return {
        "eq14.noise_printed_deg": _robust_sigma(np.degrees(printed)),
        "eq14.noise_corrected_deg": _robust_sigma(np.degrees(_turns(w, w_, camera)[0])),
    }


def chord_errors(rng: np.random.Generator, runs: int) -> dict[str, float]:
    """What (16) makes of a chord of 0.1 m, on exact points, m; sigma of (17), mm, as printed but
    for its sign, and of the corrected solution, 80 px below the horizon."""
    camera, (turn, chord) = spec_camera(), (0.02, 0.1)
    P, _, _, _ = _pair(rng, camera, turn, chord)
    near = P * (_USUAL_DEPTH / P[:, 2:])
    near_ = moved(near, planar(turn, chord), camera)
    values = {
        "eq16.printed_m": float(np.median(chord_of_points(near, near_, turn / 2, sign=1.0))),
        "eq16.corrected_m": float(np.median(chord_of_points(near, near_, turn / 2, sign=-1.0))),
    }
    for depth in (2.0, 5.0):
        w, w_ = _measured(rng, 100 * runs, camera, (0.0, 80.0), depth, 0.0, 0.0)
        printed = chord_of_points(_points(w, camera), _points(w_, camera), 0.0, sign=-1.0)
        corrected = _chords(w, w_, 0.0, camera)
        values[f"eq17.at_{depth:.0f}m_printed_mm"] = 1e3 * _robust_sigma(printed)
        values[f"eq17.at_{depth:.0f}m_corrected_mm"] = 1e3 * _robust_sigma(corrected)
    return values


def ranges(rng: np.random.Generator) -> dict[str, float]:
    """Largest mismatch of (18), first half, relative: d taken as the disparity, as the paper's
    letter says, and as the horizontal range."""
    camera, (turn, chord) = spec_camera(), (0.06, 0.12)
    P, P_, w, w_ = _pair(rng, camera, turn, chord)
    (U, V), (U_, V_) = _centred(w, camera), _centred(w_, camera)
    tan_alpha, tan_alpha_ = V / np.hypot(U, camera.fx), V_ / np.hypot(U_, camera.fx)
    printed = w[:, 2] * tan_alpha / (w_[:, 2] * tan_alpha_) - 1
    D, D_ = np.hypot(P[:, 0], P[:, 2]), np.hypot(P_[:, 0], P_[:, 2])
    return {
        "eq18.printed": float(np.median(np.abs(printed))),
        "eq18.corrected": _largest(D * tan_alpha / (D_ * tan_alpha_) - 1),
    }


def rejections(rng: np.random.Generator, runs: int) -> dict[str, float]:
    """Good points that (20) and the Sampson error reject, percent, at the threshold that keeps 95
    of 100 at (80, 80) px: near the horizon, and near the epipole."""
    camera, (turn, chord), n = spec_camera(), (0.02, 0.1), 100 * runs
    places = {"reference": (80.0, 80.0), "horizon": (80.0, 10.0), "epipole": (5.0, 80.0)}
    values = {}
    for form, error in (("printed", ratio_error), ("corrected", sampson_error)):
        errors = {
            place: error(*_measured(rng, n, camera, UV, 2.0, turn, chord), turn / 2, camera)
            for place, UV in places.items()
        }
        threshold = np.percentile(errors.pop("reference"), 95)
        for place, at_place in errors.items():
            values[f"eq20.{place}_{form}_percent"] = 100 * float(np.mean(at_place > threshold))
    return values


def residuals(rng: np.random.Generator, runs: int) -> dict[str, float]:
    """Largest residual of (21) on exact points, m, and how many times larger its noise is at 5 m
    than at 1 m: in metres, as printed, and of the disparity-space error in sigmas."""
    camera, (turn, chord), n = spec_camera(), (0.06, 0.12), 100 * runs
    P, P_, _, _ = _pair(rng, camera, turn, chord)
    metres, sigmas = [], []
    for depth in (1.0, 5.0):
        w, w_ = _measured(rng, n, camera, (60.0, 60.0), depth, turn, chord)
        metres.append(np.median(_residual(_points(w, camera), _points(w_, camera), turn, chord)))
        sigmas.append(np.median(_in_sigmas(w, w_, turn, chord, camera)))
    return {
        "eq21.residual_m": _largest(_residual(P, P_, turn, chord)),
        "eq21.printed_times": float(metres[1] / metres[0]),
        "eq21.corrected_times": float(sigmas[1] / sigmas[0]),
    }


def _residual(P: Array, P_: Array, turn: float, chord: float) -> Array:
    """error_rho (n,) by eq. (21), with its printed sign, m."""
    c, s = np.cos(turn), np.sin(turn)
    R = np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])
    along = chord * np.array([np.sin(turn / 2), 0, np.cos(turn / 2)])
    return np.asarray(np.linalg.norm(P_ - P @ R.T + along, axis=1))


def _in_sigmas(w: Array, w_: Array, turn: float, chord: float, camera: StereoCamera) -> Array:
    """(n,) Mahalanobis distance of w_ from where the motion takes w, by numerical derivative."""

    def forecast(at: Array) -> Array:
        return seen(moved(_points(at, camera), planar(turn, chord), camera), camera)

    h = 1e-4
    J = np.stack([(forecast(w + h * e) - forecast(w - h * e)) / (2 * h) for e in np.eye(3)], -1)
    Sw = SIGMA_PX**2 * np.array([[1.0, 0, 1], [0, 1, 0], [1, 0, 2]])
    S = J @ Sw @ J.transpose(0, 2, 1) + Sw
    r = w_ - forecast(w)
    return np.asarray(np.sqrt(np.einsum("ni,ni->n", r, np.linalg.solve(S, r[..., None])[..., 0])))


def _pair(
    rng: np.random.Generator, camera: StereoCamera, turn: float, chord: float
) -> tuple[Array, Array, Array, Array]:
    """Exact points of both frames, clear of the horizon, in metres and as the eyes see them."""
    P = scattered(rng, 400, camera)
    P = P[np.abs(P[:, 1] / P[:, 2]) * camera.fy > 10]
    P_ = moved(P, planar(turn, chord), camera)
    visible = P_[:, 2] > 0.2
    P, P_ = P[visible], P_[visible]
    return P, P_, seen(P, camera), seen(P_, camera)


def _measured(
    rng: np.random.Generator,
    n: int,
    camera: StereoCamera,
    UV: tuple[float, float],
    depth: float,
    turn: float,
    chord: float,
) -> tuple[Array, Array]:
    """One point measured n times before and after a motion."""
    P = at_pixels(np.tile(UV, (n, 1)), np.full(n, depth), camera)
    P_ = moved(P, planar(turn, chord), camera)
    return noisy(seen(P, camera), rng), noisy(seen(P_, camera), rng)


def _points(w: Array, camera: StereoCamera) -> Array:
    """Points (n, 3) [m] by eq. (13)."""
    return at_pixels(
        w[:, :2] - [camera.cx, camera.cy], camera.fx * camera.baseline / w[:, 2], camera
    )


def _centred(w: Array, camera: StereoCamera) -> tuple[Array, Array]:
    return w[:, 0] - camera.cx, w[:, 1] - camera.cy


def _turns(w: Array, w_: Array, camera: StereoCamera) -> tuple[Array, Array]:
    solver, points = _levelled(w, w_, camera)
    return solver.turns(points, _noise(w), _LEVEL)


def _chords(w: Array, w_: Array, turn: float, camera: StereoCamera) -> Array:
    solver, points = _levelled(w, w_, camera)
    return solver.chords(points, turn, _noise(w), _LEVEL)[0]


def _levelled(w: Array, w_: Array, camera: StereoCamera) -> tuple[PlanarSolver, LevelledPoints]:
    solver = PlanarSolver(camera)
    return solver, solver.level(w, w_)


def _noise(w: Array) -> Array:
    return np.tile(SIGMA_PX**2 * np.array([1.0, 1.0, 2.0, 1.0, 1.0, 2.0]), (len(w), 1))


def _largest(errors: Array) -> float:
    return float(np.abs(errors).max())


def _robust_sigma(values: Array) -> float:
    """Half the width of what holds 68 of 100: the printed form's tails have no variance."""
    low, high = np.percentile(values, [15.87, 84.13])
    return float(high - low) / 2
