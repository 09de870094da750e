"""What a robot reports of its motion: numbers, or NaN where it reports nothing."""

import numpy as np

from grouser.estimators.base import Observation
from grouser.geometry import Array


def reported(observation: Observation, key: str, *, shape: str, n: int) -> Array | None:
    """(n,) what the observation has under a key; None where it reports NaN.

    Args:
        shape: what it must be, in words.

    Raises:
        ValueError: it is something else, or infinite.
    """
    told = np.array(observation[key], dtype=np.float64)
    if told.shape != (n,) or np.isinf(told).any():
        raise ValueError(f"observation {key!r} must be {shape}, got {told}")
    return None if np.isnan(told).any() else told
