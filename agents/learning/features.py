"""What a network is shown of GoalNav's observation: the same numbers in training and afterwards."""

from collections.abc import Mapping
from typing import Any, Final

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

_NEAR: Final = 0.08
"""Share of the lidar's range (1 m of 12) over which nearness fades."""
_CLOSE: Final = 0.1
"""The same of the goal, in units of its distance."""
_UNSURE: Final = 1e-6
"""Variances below this are alike."""


def n_features(space: spaces.Dict) -> int:
    """How many features observations of a space have.

    Raises:
        ValueError: the space shows images, or lacks what a driver needs.
    """
    return len(features({key: np.zeros(part.shape) for key, part in _known(space).items()}))


def features(observation: Mapping[str, Any]) -> NDArray[np.float32]:
    """(..., n) features of normalised observations, of one or many at a time.

    Beams and the goal are shown twice, the second time so that differences close by stand out.
    """
    beams, goal = np.asarray(observation["beams"]), np.asarray(observation["goal"])
    parts = [
        beams,
        np.exp(-beams / _NEAR),
        np.minimum(goal[..., :1], 2.0),
        np.exp(-goal[..., :1] / _CLOSE),
        goal[..., 1:],
        np.asarray(observation["last_action"]),
    ]
    if "pose_covariance" in observation:
        parts.append(_digest(np.asarray(observation["pose_covariance"])))
    return np.concatenate(parts, axis=-1).astype(np.float32)


def _digest(covariance: NDArray[Any]) -> NDArray[Any]:
    """(..., 2) tenths of the logarithm of the position's and the heading's variance, from the upper
    triangle (..., 6)."""
    variances = np.stack([covariance[..., 0] + covariance[..., 3], covariance[..., 5]], axis=-1)
    return np.asarray(np.log(np.maximum(variances, 0.0) / _UNSURE + 1.0) / 10.0)


def _known(space: spaces.Dict) -> Mapping[str, spaces.Space[Any]]:
    known = {"beams", "goal", "last_action", "pose_covariance"}
    given = set(space.spaces)
    if not known - {"pose_covariance"} <= given <= known:
        raise ValueError(
            f"a driver learns from observations {sorted(known)}, of which it may lack "
            f"pose_covariance; this environment shows {sorted(given)}: make it with "
            'policy_sensors=("lidar",)'
        )
    return space.spaces
