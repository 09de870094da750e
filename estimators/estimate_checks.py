"""Is one estimate well-formed, and does it stand on memory of its own?"""

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from grouser.estimators.base import Observation, PoseEstimate, Status


def require(condition: bool, subject: str, message: str) -> None:
    if not condition:
        raise AssertionError(f"{subject}: {message}")


def check_values(
    subject: str, frame: int, estimate: PoseEstimate, observation: Observation
) -> None:
    at = f"frame {frame}: "
    require(isinstance(estimate, PoseEstimate), subject, f"{at}got {type(estimate).__name__}")
    _check_array(subject, f"{at}pose", estimate.pose, (3,))
    _check_array(subject, f"{at}covariance", estimate.covariance, (3, 3))
    heading = estimate.pose[2]
    wrapped = -np.pi < heading <= np.pi
    require(wrapped, subject, f"{at}heading {heading} is not wrapped to (-pi, pi]")
    P = estimate.covariance
    scale = max(float(np.abs(P).max()), 1e-300)
    require(np.abs(P - P.T).max() <= 1e-12 * scale, subject, f"{at}covariance is not symmetric")
    smallest = np.linalg.eigvalsh(P)[0]
    semidefinite = smallest >= -1e-9 * scale
    require(semidefinite, subject, f"{at}covariance has the negative eigenvalue {smallest}")
    if estimate.pose_3d is not None:
        _check_array(subject, f"{at}pose_3d", estimate.pose_3d, (4, 4))
        R = estimate.pose_3d[:3, :3]
        rotation = np.allclose(R @ R.T, np.eye(3), atol=1e-6) and np.linalg.det(R) > 0
        require(rotation, subject, f"{at}pose_3d holds no rotation")
    require(isinstance(estimate.status, Status), subject, f"{at}status is {estimate.status!r}")
    stamp = float(observation["stamp"][0])
    require(estimate.stamp == stamp, subject, f"{at}stamp is {estimate.stamp}, not {stamp}")
    for key, value in estimate.diagnostics.items():
        number = isinstance(value, int | float)
        require(number, subject, f"{at}diagnostic {key!r} is no number: {value!r}")


def _check_array(subject: str, what: str, value: Any, shape: tuple[int, ...]) -> None:
    is_array = isinstance(value, np.ndarray) and value.dtype == np.float64
    require(is_array, subject, f"{what} must be a float64 array, got {value!r}")
    require(value.shape == shape, subject, f"{what} must have shape {shape}, got {value.shape}")
    require(bool(np.isfinite(value).all()), subject, f"{what} is not finite: {value.tolist()}")


def check_memory(
    subject: str,
    frame: int,
    estimate: PoseEstimate,
    observation: Observation,
    earlier: list[PoseEstimate],
) -> None:
    for name, array in arrays(estimate):
        for key, shown in observation.items():
            shared = np.shares_memory(array, shown)
            require(not shared, subject, f"frame {frame}: {name} shares memory with {key!r}")
        for old_name, old in arrays(earlier[-1]) if earlier else ():
            shared = np.shares_memory(array, old)
            said = f"frame {frame}: {name} shares memory with {old_name} of the frame before"
            require(not shared, subject, said)


def require_same(
    subject: str, expected: list[PoseEstimate], got: list[PoseEstimate], who: str
) -> None:
    for old, new in zip(expected, got, strict=True):
        pairs = zip(arrays(old), arrays(new), strict=True)
        same = all(np.array_equal(a, b) for (_, a), (_, b) in pairs)
        require(
            same and old.status == new.status,
            subject,
            f"{who}, differs at {old.stamp:.1f} s: {old.pose.tolist()} {old.status} became "
            f"{new.pose.tolist()} {new.status}; the same generator and observations must give "
            "the same bits",
        )


def arrays(estimate: PoseEstimate) -> Iterator[tuple[str, NDArray[Any]]]:
    """Its arrays with their names."""
    yield "pose", estimate.pose
    yield "covariance", estimate.covariance
    if estimate.pose_3d is not None:
        yield "pose_3d", estimate.pose_3d
