"""What the paper prints of the vehicle's motion, eqs. (5) to (7), against what is right (SPEC 2.1).

Where the filter has an equation, the filter's own code is asked.
"""

import numpy as np

from grouser.estimators.line_slam.ackermann import AckermannPredictor, steered, steered_jacobian
from grouser.estimators.line_slam.motion import MotionModel, PredictedMotion, PrintedSteering
from grouser.geometry import Array, compose, rotate
from grouser.rig import Rig
from grouser.rig_motion import Steering

_H = 1e-6
_TINY = 1e-6  # s


def axle(steering: Steering) -> dict[str, float]:
    """Sideways speed [m/s] of the rear wheels, which roll and do not slip, at full speed and angle:
    (x, y) of (5) taken for the rear axle and for the front one."""
    control = np.array([steering.max_speed, steering.max_angle])
    moved = steered(control, steering.wheelbase, _TINY)
    behind = np.array([-steering.wheelbase, 0.0])
    as_front = rotate(moved[2], behind) + moved[:2] - behind
    return {
        "eq5.rear_m_s": abs(moved[1]) / _TINY,
        "eq5.front_m_s": abs(as_front[1]) / _TINY,
    }


def motion_jacobians(rng: np.random.Generator, rig: Rig, points: int) -> dict[str, float]:
    """Largest differences from finite differences, of (6) and (7) at random states."""
    steering, dt = rig.steering, rig.dt
    assert steering is not None
    worst = dict.fromkeys(("eq6.printed", "eq6.corrected", "eq7.printed", "eq7.corrected"), 0.0)
    for _ in range(points):
        pose = rng.uniform([-30, -30, -np.pi], [30, 30, np.pi])
        control = rng.uniform([1.0, -steering.max_angle], [steering.max_speed, steering.max_angle])
        numeric = _differences(pose, control, steering.wheelbase, dt)
        models: dict[str, MotionModel] = {
            "printed": PrintedSteering(steering, dt),
            "corrected": PredictedMotion(AckermannPredictor(steering, dt)),
        }
        for kind, model in models.items():
            step = model.predict({"steering": control}, pose, np.zeros(0))
            _note(worst, f"eq6.{kind}", step.by_pose - numeric[:, :3])
        by_control = {
            "printed": _printed_7(pose, control, steering.wheelbase, dt),
            "corrected": _corrected_7(pose, control, steering.wheelbase, dt),
        }
        for kind, G in by_control.items():
            _note(worst, f"eq7.{kind}", G - numeric[:, 3:])
    return worst


def _note(worst: dict[str, float], name: str, difference: Array) -> None:
    worst[name] = max(worst[name], float(np.abs(difference).max()))


def _differences(pose: Array, control: Array, wheelbase: float, dt: float) -> Array:
    """(3, 5) derivative of (5) by the pose and the control."""
    at = np.concatenate([pose, control])
    columns = []
    for d in _H * np.eye(5):
        up, down = (compose(v[:3], steered(v[3:], wheelbase, dt)) for v in (at + d, at - d))
        change = up - down
        change[2] = np.remainder(change[2] + np.pi, 2 * np.pi) - np.pi
        columns.append(change / (2 * _H))
    return np.stack(columns, axis=-1)


def _printed_7(pose: Array, control: Array, L: float, T: float) -> Array:
    V, a = control.tolist()
    c, s = np.cos(pose[2] + a), np.sin(pose[2] + a)
    return T * np.array([[c, -V * s], [-s, V * c], [np.sin(a) / L, V * np.cos(a) / L]])


def _corrected_7(pose: Array, control: Array, L: float, T: float) -> Array:
    """The filter's, in the frame before the step, turned into the world's."""
    G = steered_jacobian(control, L, T)
    G[:2] = rotate(pose[2], G[:2].T).T
    return G
