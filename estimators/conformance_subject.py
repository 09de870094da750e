"""An estimator under check and the drive that it is shown."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from grouser.estimators import registry
from grouser.estimators.base import (
    TRUTH_KEYS,
    Observation,
    PoseEstimate,
    PoseEstimator,
    readable,
)
from grouser.estimators.synthetic_drive import Drive, synthetic_drive

LIGHT, DARK, LIGHT_AGAIN = 16, 15, 10
"""Frames before, in and after the blackout; 1.5 s of it."""


@dataclass(frozen=True, slots=True)
class Subject:
    """A registered estimator with options; every instance of it is shown the same drive."""

    name: str
    options: dict[str, Any]

    @property
    def drive(self) -> Drive:
        dark = range(LIGHT, LIGHT + DARK)
        return synthetic_drive(frames=LIGHT + DARK + LIGHT_AGAIN, blackout=dark)

    @property
    def last_light(self) -> int:
        return LIGHT - 1

    @property
    def last_dark(self) -> int:
        return LIGHT + DARK - 1

    @property
    def reads_truth(self) -> bool:
        return bool(registry.estimator_class(self.name).requires & TRUTH_KEYS)

    def make(self) -> PoseEstimator:
        return registry.make(self.name, self.drive.rig, **self.options)

    def shown(self, estimator: PoseEstimator, frame: int) -> dict[str, NDArray[Any]]:
        """A copy of one observation, cut down to what the estimator may read."""
        seen = readable(estimator, self.drive.observations[frame], self.drive.truths[frame])
        return {key: np.array(value) for key, value in seen.items()}

    def advance(
        self, estimator: PoseEstimator, observation: Observation, frame: int, *, first: int = 0
    ) -> PoseEstimate:
        """Show one observation: to `reset` in the first frame of a run, to `update` in all others.

        Raises:
            AssertionError: the estimator raised; the contract allows it no exception.
        """
        try:
            if frame == first:
                return estimator.reset(observation, rng=np.random.default_rng(0))
            return estimator.update(observation)
        except Exception as error:
            dark = " of the blackout" if LIGHT <= frame < LIGHT + DARK else ""
            raise AssertionError(f"{self.name}: frame {frame}{dark} raised {error!r}") from error

    def run(self, estimator: PoseEstimator) -> list[PoseEstimate]:
        """The whole drive."""
        frames = range(len(self.drive.observations))
        return [self.advance(estimator, self.shown(estimator, frame), frame) for frame in frames]
