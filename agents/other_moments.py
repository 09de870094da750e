"""Covariances of other moments, which say nothing of this one: the control of an ablation.

A policy that is shown them has as much to look at as one that is shown the estimate's own, with the
same values as often; what it drives better or worse with the estimate's own, it owes to what they
tell.
"""

from collections import deque
from collections.abc import Callable
from typing import TYPE_CHECKING, Final

import numpy as np

from grouser.agents.drive import steps
from grouser.agents.pursuit import Pursuit
from grouser.geometry import Array

if TYPE_CHECKING:
    from grouser.agents.navigation import GoalNavEnv

_REHEARSALS: Final = 4
"""Episodes that a driver with a map makes before the first one."""
_REMEMBERED: Final = 4096
"""Covariances of the last moments that are drawn from."""


class OtherMoments:
    """Draws from the covariances of episodes that are over.

    Before the first of them a driver with a map goes through a few others, in worlds of their own.

    Args:
        make: the task without this; where it is rehearsed.
    """

    def __init__(self, make: Callable[[], "GoalNavEnv"]) -> None:
        self._make = make
        self._past: deque[Array] = deque(maxlen=_REMEMBERED)
        self._present: list[Array] = []

    def reset(self, *, anew: bool, rng: np.random.Generator) -> None:
        """A new episode.

        Args:
            anew: forget all that was, as after a seed.
            rng: of the environment; what is drawn are its children's.
        """
        if anew or not self._past:
            rehearsing, self._rng = rng.spawn(2)
            self._past.clear()
            self._past.extend(self._rehearse(rehearsing))
        else:
            self._past.extend(self._present)
        self._present = []

    def instead_of(self, covariance: Array) -> Array:
        """(3, 3) another moment's; this one's is for episodes to come."""
        self._present.append(covariance.copy())
        return self._past[int(self._rng.integers(len(self._past)))]

    def _rehearse(self, rng: np.random.Generator) -> list[Array]:
        env, driver = self._make(), Pursuit()
        try:
            return [
                step.believed.covariance.copy()
                for seed in rng.integers(2**31, size=_REHEARSALS).tolist()
                for step in steps(env, driver, seed)
            ]
        finally:
            env.close()
