"""What the paper prints of observations, eqs. (10) to (13) and section 1.3, against what is right
(SPEC 2.1 and 2.2)."""

import numpy as np

from grouser.estimators.line_slam.linearization import at, jacobian
from grouser.estimators.line_slam.lines import lines_in_frame
from grouser.geometry import Array, wrap

_H = 1e-6
_SIGMA_R, _SIGMA_B = 0.1, float(np.radians(1.0))
_POSE_SIGMAS = (0.2, 0.2, float(np.radians(0.4)))
"""m, m, rad: as well as the filter knows its pose on the course."""
_GATE = 9.21


def bearings(rng: np.random.Generator, points: int) -> dict[str, float]:
    """Largest error [rad] of the bearing of a landmark, by arctan and by atan2."""
    dx, dy = rng.uniform(-30, 30, (2, points))
    true = np.angle(dx + 1j * dy)
    return {
        "eq10.printed_rad": float(np.abs(wrap(np.arctan(dy / dx) - true)).max()),
        "eq10.corrected_rad": float(np.abs(wrap(np.arctan2(dy, dx) - true)).max()),
    }


def point_jacobians(rng: np.random.Generator, points: int) -> dict[str, float]:
    """Largest differences from finite differences, of the parts of (11)."""
    parts = {"eq11.pose_and_row_1": 0.0, "eq11.printed": 0.0, "eq11.corrected": 0.0}
    for _ in range(points):
        state = rng.uniform([-30, -30, -np.pi, -30, -30], [30, 30, np.pi, 30, 30])
        numeric = np.stack(
            [_polar_difference(state + d, state - d) / (2 * _H) for d in _H * np.eye(5)], axis=-1
        )
        printed = np.abs(_printed_11(state) - numeric)
        corrected = np.abs(_corrected_11(state) - numeric)
        parts["eq11.printed"] = max(parts["eq11.printed"], float(printed[1, 3:].max()))
        parts["eq11.corrected"] = max(parts["eq11.corrected"], float(corrected[1, 3:].max()))
        right = max(float(printed[0].max()), float(printed[1, :3].max()))
        parts["eq11.pose_and_row_1"] = max(parts["eq11.pose_and_row_1"], right)
    return parts


def line_jacobians(rng: np.random.Generator, points: int) -> dict[str, float]:
    """Largest difference from finite differences, of what stands in (11)'s place for lines."""
    worst = 0.0
    for _ in range(points):
        state = rng.uniform([-30, -30, -np.pi, -30, -np.pi], [30, 30, np.pi, 30, np.pi])
        columns = []
        for d in _H * np.eye(5):
            up, down = (lines_in_frame(v[3:], v[:3]) for v in (state + d, state - d))
            change = up - down
            change[1] = wrap(change[1])
            columns.append(change / (2 * _H))
        H = jacobian(at(state[4:], state[:3])[0])
        worst = max(worst, float(np.abs(H - np.stack(columns, axis=-1)).max()))
    return {"lines.jacobian": worst}


def distances(rng: np.random.Generator, draws: int) -> dict[str, float]:
    """(13) of a line of the map that is seen again: its mean over degrees of freedom, and how
    often it is taken for another; V the variance of the observation alone, and S."""
    line = np.array([12.0, 0.7])
    pose, R = np.array([3.0, -4.0, 0.3]), np.diag([_SIGMA_R**2, _SIGMA_B**2])
    H = jacobian(at(line[1:], pose)[0])[:, :3]
    S = H @ np.diag(np.square(_POSE_SIGMAS)) @ H.T + R
    noise = rng.multivariate_normal(np.zeros(2), R, draws)
    truth = pose + rng.normal(size=(draws, 3)) * _POSE_SIGMAS
    z = np.array([lines_in_frame(line, p) for p in truth]) + noise
    nu = z - lines_in_frame(line, pose)
    nu[:, 1] = wrap(nu[:, 1])
    values = {}
    for name, V in (("printed", R), ("corrected", S)):
        d2 = np.einsum("ni,ij,nj->n", nu, np.linalg.inv(V), nu)
        values[f"eq13.{name}"] = float(d2.mean())
        values[f"eq13.{name}_refused_percent"] = 100 * float((d2 > _GATE).mean())
    return values


def foot_information() -> dict[str, float]:
    """What one sight of a line tells of the robot's way along it, as a standard deviation^-2
    [1/m^2]: as (11) claims of its foot point, and as (r, alpha) has it."""
    line, pose = np.array([12.0, 0.7]), np.array([3.0, -4.0, 0.3])
    u = np.array([-np.sin(line[1]), np.cos(line[1]), 0.0])
    foot = line[0] * np.array([np.cos(line[1]), np.sin(line[1])])
    information = np.diag([_SIGMA_R**-2, _SIGMA_B**-2])
    of_point = _corrected_11(np.concatenate([pose, foot]))[:, :3] @ u
    of_line = jacobian(at(line[1:], pose)[0])[:, :3] @ u
    return {
        "foot.printed": float(of_point @ information @ of_point),
        "foot.corrected": float(of_line @ information @ of_line),
    }


def near_origin(r: float = 0.07) -> dict[str, float]:
    """Largest entry of d(r, alpha) / d(foot), where the world's origin is so near [m] to a line;
    of (r, alpha) by itself it is 1."""
    return {"foot.singular": float(np.abs(np.array([[1.0, 0.0], [0.0, 1 / r]])).max())}


def _polar(state: Array) -> Array:
    x, y, heading, px, py = state
    return np.array([np.hypot(px - x, py - y), np.arctan2(py - y, px - x) - heading])


def _polar_difference(up: Array, down: Array) -> Array:
    change = _polar(up) - _polar(down)
    change[1] = wrap(change[1])
    return change


def _printed_11(state: Array) -> Array:
    H = _corrected_11(state)
    dx, dy = state[:2] - state[3:]  # eq. (12)
    D2 = dx**2 + dy**2
    H[1, 3:] = -dx / D2, -dy / D2
    return H


def _corrected_11(state: Array) -> Array:
    dx, dy = state[:2] - state[3:]
    D = np.hypot(dx, dy)
    return np.array(
        [
            [dx / D, dy / D, 0.0, -dx / D, -dy / D],
            [-dy / D**2, dx / D**2, -1.0, dy / D**2, -dx / D**2],
        ]
    )
