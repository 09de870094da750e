"""What the tracked robot's environment takes, checked, with words where it is wrong."""

import math
from collections.abc import Iterable, Sequence
from numbers import Integral

import numpy as np

from grouser.geometry import Array


def known_mode(mode: str | None, modes: Sequence[str]) -> str | None:
    """A render mode that there is.

    Raises:
        ValueError: it is none; the message lists those there are.
    """
    if mode is not None and mode not in modes:
        raise ValueError(f"no render mode is named {mode!r}; known: None, {', '.join(modes)}")
    return mode


def checked_image_size(size: Sequence[int]) -> tuple[int, int]:
    """Width and height, px.

    Raises:
        ValueError: they are not two whole numbers in the range that a camera has.
    """
    listed = tuple(size) if isinstance(size, Iterable) else ()
    if len(listed) != 2 or not all(isinstance(n, Integral) and 16 <= n <= 4096 for n in listed):
        raise ValueError(
            f"image_size must be width and height, whole numbers from 16 to 4096, got {size!r}"
        )
    return int(listed[0]), int(listed[1])


def checked_action(action: object) -> Array:
    """(2,) clipped to [-1, 1].

    Raises:
        ValueError: it is not two finite numbers.
    """
    values = np.asarray(action, dtype=np.float64)
    each = values.ravel().tolist()  # two numbers are faster by hand
    if values.shape != (2,) or not all(map(math.isfinite, each)):
        raise ValueError(
            "an action is two finite numbers, the left and right track's speed as a fraction of "
            f"the top speed, got {action!r}"
        )
    return np.array([min(max(value, -1.0), 1.0) for value in each])
