"""Images by the time that they are of: late, seldom, or one eye before the other."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from grouser.estimators.base import SAME_TIME, Observation, stamp_of

_MOST_WAITING = 64  # images of one eye that wait for the other


class LatePictures:
    """Keeps the images of each eye until those of all eyes of the same time are there.

    An image is of the time that `left_stamp` or `right_stamp` says, or else of now.
    """

    def __init__(self, eyes: Sequence[str]) -> None:
        self._eyes = tuple(eyes)

    def reset(self, observation: Observation) -> None:
        """Start with the first observation, whose images are of now."""
        self._seen_at = float(observation["stamp"][0])
        self._waiting: dict[str, dict[float, NDArray[Any]]] = {eye: {} for eye in self._eyes}

    def may_be_late(self, observation: Observation) -> bool:
        """Whether the observation says of when its images are."""
        return any(f"{eye}_stamp" in observation for eye in self._eyes)

    def take(self, observation: Observation) -> None:
        """Note what is new."""
        for eye in self._eyes:
            waiting, stamp = self._waiting[eye], stamp_of(eye, observation)
            if stamp > self._seen_at + SAME_TIME and stamp not in waiting:
                waiting[stamp] = observation[eye].copy()
                if len(waiting) > _MOST_WAITING:
                    del waiting[min(waiting)]

    def newest(self, *, until: float = np.inf) -> float | None:
        """The time of the newest complete set of images, up to a time; None without one."""
        first, *others = (set(waiting) for waiting in self._waiting.values())
        complete = first.intersection(*others)
        return max((stamp for stamp in complete if stamp < until + SAME_TIME), default=None)

    def pop(self, stamp: float) -> dict[str, NDArray[Any]]:
        """The images of a time; they and older ones are done with."""
        images = {eye: waiting[stamp] for eye, waiting in self._waiting.items()}
        self.skip(stamp)
        return images

    def skip(self, stamp: float) -> None:
        """Images up to a time are too late, or seen."""
        self._seen_at = stamp
        for eye, waiting in self._waiting.items():
            self._waiting[eye] = {t: image for t, image in waiting.items() if t > stamp + SAME_TIME}
