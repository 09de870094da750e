"""What the paper prints of the tracks, eqs. (2) to (11), against what is right (SPEC 1.1)."""

import numpy as np

from grouser.estimators.evaluation.consistency import nees
from grouser.estimators.track_motion import arc_pose, track_increment, track_increment_jacobian
from grouser.geometry import Array, compose, compose_jacobians

_GAP, _WIDTH = 0.30, 0.06  # m: between the tracks' inner edges, and of one track (SPEC 1.1)
_W = _GAP + _WIDTH
_TRACK_NOISE = 0.2  # of an increment, as SPEC 1.1 has it
_STEPS = 100


def chords() -> dict[str, float]:
    """Relative error of the way by (2) and (3) in a step of 1 rad, percent."""
    turn, arc = 1.0, 0.5
    true = float(np.linalg.norm(arc_by_small_steps(turn, arc)))
    return {
        "eq2.printed_percent": 100 * (arc / true - 1),
        "eq2.corrected_percent": 100 * (float(np.linalg.norm(arc_pose(turn, arc)[:2])) / true - 1),
    }


def arc_by_small_steps(turn: float, arc: float, n: int = 200_000) -> Array:
    """(2,) end of an arc, by adding up short straight ways."""
    heading = turn * (np.arange(n) + 0.5) / n
    return np.array([np.cos(heading).mean(), np.sin(heading).mean()]) * arc


def widths() -> dict[str, float]:
    """Turn by (4) over the true turn of tracks that do not slip: b the width, or half of it."""
    true = 0.1
    difference = true * _W
    du = np.array([0.2 - difference / 2, 0.2 + difference / 2])
    return {
        "eq4.printed": difference / (_GAP + 2 * _WIDTH) / true,
        "eq4.half_width": difference / (_GAP + 2 * (_WIDTH / 2)) / true,
        "eq4.corrected": track_increment(du, _W)[0] / true,
    }


def input_jacobian() -> dict[str, float]:
    """Largest difference from finite differences, of (10) taken as the input's Jacobian."""
    pose, du, h = np.array([0.3, -0.2, 0.7]), np.array([0.10, 0.25]), 1e-6
    numeric = np.stack(
        [(_moved(pose, du + h * e) - _moved(pose, du - h * e)) / (2 * h) for e in np.eye(2)], -1
    )
    return {
        "eq10.printed": float(np.abs(_B(pose, du) - numeric).max()),
        "eq10.corrected": float(np.abs(_V(pose, du) - numeric).max()),
    }


def dead_reckoning_nees(rng: np.random.Generator, runs: int) -> dict[str, float]:
    """Mean NEES (3 is honest) at the end of dead reckoning with white track noise, in a curve:
    covariance by (9) and (10), and by the Jacobians of what they describe."""
    truth, du = np.zeros(3), np.array([0.045, 0.055])
    for _ in range(_STEPS):
        truth = _moved(truth, du)
    ends, printed, corrected = [], [], []
    for _ in range(runs):
        pose, P_printed, P = np.zeros(3), np.zeros((3, 3)), np.zeros((3, 3))
        for _ in range(_STEPS):
            measured = du * (1 + _TRACK_NOISE * rng.normal(size=2))
            Q = np.diag((_TRACK_NOISE * measured) ** 2)
            B, V = _B(pose, measured), _V(pose, measured)
            G, _ = compose_jacobians(pose, _increment(measured))
            P_printed = P_printed + B @ Q @ B.T  # eq. (9): F is the identity
            P = G @ P @ G.T + V @ Q @ V.T
            pose = _moved(pose, measured)
        ends.append(pose)
        printed.append(P_printed)
        corrected.append(P)
    true, end = np.tile(truth, (runs, 1)), np.array(ends)
    return {
        "eq9.printed_nees": float(np.nanmean(nees(true, end, np.array(printed)))),
        "eq9.corrected_nees": float(np.nanmean(nees(true, end, np.array(corrected)))),
    }


def _increment(du: Array) -> Array:
    """(3,) by eqs. (2) to (5), with the width of (4) right."""
    turn, way = (du[1] - du[0]) / _W, du.mean()
    return np.array([way * np.cos(turn / 2), way * np.sin(turn / 2), turn])


def _moved(pose: Array, du: Array) -> Array:
    return np.asarray(compose(pose, _increment(du)))


def _B(pose: Array, du: Array) -> Array:
    """Eq. (10), with the width of (4) right."""
    heading = pose[2] + (du[1] - du[0]) / (2 * _W)
    c, s = np.cos(heading), np.sin(heading)
    return np.array([[c, c], [s, s], [-2 / _W, 2 / _W]]) / 2


def _V(pose: Array, du: Array) -> Array:
    """Derivative of (2) to (5) by the tracks' increments (SPEC 1.1)."""
    by_turn, by_way = track_increment_jacobian(_W)
    heading, way = pose[2] + (du[1] - du[0]) / (2 * _W), du.mean()
    c, s = np.cos(heading), np.sin(heading)
    x = c * by_way - way * s / 2 * by_turn
    y = s * by_way + way * c / 2 * by_turn
    return np.stack([x, y, by_turn])
