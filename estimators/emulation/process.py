"""Errors drawn step by step from an error model, with the covariance that the model has of them."""

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from grouser.estimators.emulation.error_model import SPOT_RADIUS, STATUSES, ErrorModel
from grouser.estimators.emulation.record import sigmas
from grouser.geometry import Array
from grouser.kernels import kernel


class Numbers(NamedTuple):
    """An error model as kernels read it; what it means is said there."""

    correction: Any
    recovery: Any
    growth: Any
    jitter: Any
    confidence: Any

    @staticmethod
    def of(model: ErrorModel) -> "Numbers":
        """Those of a model."""
        return Numbers(
            model.correction, model.recovery, model.growth, model.jitter, model.confidence
        )


class ErrorProcess:
    """An episode's errors: give it every true pose, it gives what the estimator would tell.

    Args:
        model: of the estimator.
        bias: (2, 3, 4) systematic errors of this episode.
        pose: (3,) true at the start, which is known exactly.
    """

    def __init__(self, model: ErrorModel, bias: Array, pose: Array) -> None:
        self._numbers, self._bias = Numbers.of(model), np.array(bias)
        self._truth, self._estimate = np.array(pose), np.array(pose)
        self._covariance = np.diag(np.append(np.zeros(3), model.bias_sigma.ravel() ** 2))
        self._status = 0

    def step(self, truth: Array, status: int, noise: Array) -> tuple[Array, Array]:
        """The pose (3,) that is told a step later, and its covariance (3, 3).

        Args:
            truth: (3,) the true pose now.
            status: index into STATUSES.
            noise: (6,) standard normal.
        """
        pose, told = np.empty(3), np.empty((3, 3))
        recovers = status == 0 and self._status != 0
        self._status = status
        _step(
            self._truth, self._estimate, self._covariance, self._bias, truth, status, recovers,
            noise, self._numbers, pose, told,
        )  # fmt: skip
        return pose, told


@kernel
def _step(
    before: Any, estimate: Any, P: Any, bias: Any, truth: Any, status: int, recovers: bool,
    noise: Any, numbers: Any, told_pose: Any, told: Any,
) -> None:  # fmt: skip
    """Carry the true pose, the estimate and the covariance P (27, 27) on; write what is told."""
    c, s = math.cos(before[2]), math.sin(before[2])
    x, y = truth[0] - before[0], truth[1] - before[1]
    forward, left = c * x + s * y, c * y - s * x
    turn = _wrapped(truth[2] - before[2])
    features = np.array([forward, turn, abs(turn), on_the_spot(forward, turn)])
    grown = (1.0, abs(forward), abs(turn))
    mode = 0 if status == 0 else 1
    q, taken_back = np.zeros(3), np.zeros(3)
    increment = np.array([forward, left, turn])
    ec, es = math.cos(estimate[2]), math.sin(estimate[2])
    gx, gy = before[0] - estimate[0], before[1] - estimate[1]
    gap = (ec * gx + es * gy, ec * gy - es * gx, _wrapped(before[2] - estimate[2]))
    for i in range(3):
        for k in range(3):
            q[i] += numbers.growth[status, i, k] * grown[k]
        for k in range(4):
            increment[i] += bias[mode, i, k] * features[k]
        if status == 0:
            found = numbers.recovery[i] if recovers else 0.0
            taken_back[i] = max(numbers.correction[i], found)
        increment[i] += taken_back[i] * gap[i] + math.sqrt(q[i]) * noise[i]
    _add(estimate, increment, estimate)
    before[:] = truth
    _carry_covariance(P, forward, left, turn, features, mode, taken_back, q)

    jitter = numbers.jitter[status] * noise[3:]
    _add(estimate, jitter, told_pose)
    _tell(P, truth[2], numbers.jitter[status], numbers.confidence[mode], told)


@kernel
def on_the_spot(forward: float, turn: float) -> float:
    """That part of a turn [rad] which is on the spot, as FEATURES says."""
    reach = math.hypot(forward, SPOT_RADIUS * turn)
    return turn * (1 - abs(forward) / reach) if reach > 0 else 0.0


@kernel
def _carry_covariance(
    P: Any, forward: float, left: float, turn: float, features: Any, mode: int, taken_back: Any,
    q: Any,
) -> None:  # fmt: skip
    """The pose's error after a step, in the robot's new frame: the old one as seen from there, less
    what is taken back, plus systematic errors and noise.

    P is that of the pose's error (3) and of the systematic errors (24), which stay as they are.
    """
    c, s = math.cos(turn), math.sin(turn)
    A = np.empty((3, 3))
    A[0, 0], A[0, 1], A[0, 2] = c, s, s * forward - c * left
    A[1, 0], A[1, 1], A[1, 2] = -s, c, c * forward + s * left
    A[2, 0], A[2, 1], A[2, 2] = 0.0, 0.0, 1.0
    for j in range(3):
        A[:, j] *= 1.0 - taken_back[j]
    n = P.shape[0]
    carried = A @ P[:3]
    for i in range(3):
        first = 3 + 12 * mode + 4 * i
        for k in range(4):
            carried[i] += features[k] * P[first + k]
    for i in range(3):
        for j in range(i + 1):
            covariance = 0.0
            for k in range(3):
                covariance += carried[i, k] * A[j, k]
            for k in range(4):
                covariance += carried[i, 3 + 12 * mode + 4 * j + k] * features[k]
            P[i, j] = P[j, i] = covariance + (q[i] if i == j else 0.0)
        for j in range(3, n):
            P[i, j] = P[j, i] = carried[i, j]


@kernel
def _tell(P: Any, heading: float, jitter: Any, confidence: Any, told: Any) -> None:
    """Write the covariance (3, 3) in the frame of the start, as the estimator would tell it."""
    c, s = math.cos(heading), math.sin(heading)
    R = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    local = P[:3, :3].copy()
    for i in range(3):
        local[i, i] += jitter[i] * jitter[i]
    scale = (confidence[0], confidence[0], confidence[1])
    told[:] = R @ local @ R.T
    for i in range(3):
        for j in range(i + 1):
            mean = 0.5 * (told[i, j] + told[j, i]) * scale[i] * scale[j]
            told[i, j] = told[j, i] = mean


@kernel
def seen_from(start: Any, pose: Any, out: Any) -> None:
    """Write into out (3,) a pose as seen from another one: `geometry.between`, for one pair."""
    c, s = math.cos(start[2]), math.sin(start[2])
    dx, dy = pose[0] - start[0], pose[1] - start[1]
    out[0], out[1], out[2] = c * dx + s * dy, c * dy - s * dx, _wrapped(pose[2] - start[2])


@kernel
def _add(pose: Any, increment: Any, out: Any) -> None:
    """out = pose (+) increment."""
    c, s = math.cos(pose[2]), math.sin(pose[2])
    x = pose[0] + c * increment[0] - s * increment[1]
    y = pose[1] + s * increment[0] + c * increment[1]
    heading = _wrapped(pose[2] + increment[2])
    out[0], out[1], out[2] = x, y, heading


@kernel
def _wrapped(angle: float) -> float:
    """To (-pi, pi]."""
    wrapped = math.pi - (math.pi - angle) % (2 * math.pi)
    return math.pi if wrapped <= -math.pi else wrapped


def emulate(model: ErrorModel, truth: Array, rng: np.random.Generator) -> tuple[Array, Array]:
    """Poses (N, 3) and covariances (N, 3, 3) that an emulator tells along a true way (N, 3).

    Its statuses are drawn, too.
    """
    bias = model.bias_mean + model.bias_sigma * rng.standard_normal((2, 3, 4))
    process = ErrorProcess(model, bias, truth[0])
    poses, covariances = [truth[0]], [np.zeros((3, 3))]
    status = rng.choice(len(STATUSES), p=model.first_status)
    for pose in truth[1:]:
        status = rng.choice(len(STATUSES), p=model.transitions[status])
        told, covariance = process.step(pose, int(status), rng.standard_normal(6))
        poses.append(told)
        covariances.append(covariance)
    return np.array(poses), np.array(covariances)


def modelled_sigmas(model: ErrorModel, truth: Array, status: NDArray[np.int64]) -> Array:
    """(N, 2) sigma of position [m] and heading [rad] along a way (N, 3), for these statuses."""
    process = ErrorProcess(model, model.bias_mean, truth[0])
    steps = zip(truth[1:], status[1:], strict=True)
    told = [process.step(pose, int(index), np.zeros(6))[1] for pose, index in steps]
    return sigmas(np.array([np.zeros((3, 3)), *told]))
