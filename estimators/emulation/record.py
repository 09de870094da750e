"""What an estimator told and what was true, frame by frame: the data that error models are of."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from grouser.estimators.emulation.error_model import STATUSES
from grouser.estimators.evaluation.results import RunTrajectories
from grouser.geometry import Array, between, project, wrap


@dataclass(frozen=True, slots=True, eq=False)
class Record:
    """One run of N frames, both in the frame of the start."""

    dt: float
    truth: Array
    """(N, 3)"""
    told: Array
    """(N, 3)"""
    covariance: Array
    """(N, 3, 3)"""
    status: NDArray[np.int64]
    """(N,) indices into STATUSES."""

    @staticmethod
    def of(run: RunTrajectories) -> "Record":
        """A run of a comparison.

        Raises:
            ValueError: the run lacks the truth, covariances or statuses.
        """
        if run.truth is None or run.statuses is None or run.estimate.covariances is None:
            lacking = "the truth" if run.truth is None else "the statuses of its frames"
            raise ValueError(
                f"{run.estimator}, seed {run.seed}: the results hold it without {lacking}, which "
                "an emulator is fitted to; compare anew, on what has a truth"
            )
        stamps = run.estimate.stamps
        return Record(
            dt=float(np.median(np.diff(stamps))),
            truth=project(run.truth.poses),
            told=project(run.estimate.poses),
            covariance=run.estimate.covariances,
            status=np.array([STATUSES.index(status) for status in run.statuses]),
        )

    @property
    def increments(self) -> Array:
        """(N - 1, 3) true motion of each step, in the frame before it."""
        return between(self.truth[:-1], self.truth[1:])

    @property
    def increment_errors(self) -> Array:
        """(N - 1, 3) told less true motion of each step, each in the frame before it."""
        error = between(self.told[:-1], self.told[1:]) - self.increments
        error[:, 2] = wrap(error[:, 2])
        return error

    @property
    def errors(self) -> Array:
        """(N, 3) the told pose seen from the true one."""
        return between(self.truth, self.told)


def sigmas(covariance: Array) -> Array:
    """(..., 2) sigma of the position [m] and of the heading [rad] of covariances (..., 3, 3)."""
    position = np.sqrt(np.maximum(covariance[..., 0, 0] + covariance[..., 1, 1], 0.0))
    return np.stack([position, np.sqrt(np.maximum(covariance[..., 2, 2], 0.0))], axis=-1)


def require_alike(records: Sequence[Record]) -> float:
    """The length of a step, s.

    Raises:
        ValueError: there are no records, or their steps differ.
    """
    if not records:
        raise ValueError("an emulator is fitted to at least one run")
    steps = {round(record.dt, 6) for record in records}
    if len(steps) > 1:
        raise ValueError(f"the runs have steps of {sorted(steps)} s; fit to runs of one robot")
    return steps.pop()
