"""The folder of a comparison: figures and trajectories of every run, written as runs are done.

results.json                              a list with an object a run
settings.json                             what all runs of the folder have in common
trajectories/NAME_seedS.tum               the estimate; 3-D where the estimator gives that
trajectories/truth/NAME_seedS.tum         the truth, where there is one
trajectories/with_covariance/NAME_seedS.tum   the planar estimate, covariance in columns 9 to 14
"""

import json
import math
import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from grouser.estimators.evaluation.comparison import Run
from grouser.estimators.evaluation.summary import Summary, covariances, planar, spatial
from grouser.geometry import lift
from grouser.trajectory import Trajectory, read_tum, write_tum

Settings = Mapping[str, Any]


@dataclass(frozen=True, slots=True)
class RunTrajectories:
    """A run as it is on disk."""

    estimator: str
    seed: int
    estimate: Trajectory
    """Planar, with covariance."""
    truth: Trajectory | None


class ResultsFolder:
    """A folder that holds the runs of one comparison and grows by a run at a time."""

    def __init__(self, path: str | Path, settings: Settings, *, resume: bool = False) -> None:
        """Begin the folder, or go on with one that was begun with the same settings.

        Raises:
            ValueError: the folder cannot be written to, or it holds results already and `resume`
                is not set, or it holds those of other settings, or its files are damaged.
        """
        self.path = Path(path)
        # Through JSON and back, to compare with what was read: a tuple becomes a list.
        self._settings: dict[str, Any] = json.loads(json.dumps(settings))
        self.summaries: list[Summary] = []
        self._check_place()
        if self._results.exists():
            if not resume:
                raise ValueError(
                    f"{self.path} already holds results; give --resume to complete them, "
                    "or another --output"
                )
            self._check_settings()
            self.summaries = _read_json(self._results, list)
            self._check_trajectories()

    def has(self, estimator: str, seed: int) -> bool:
        """Whether that run is already there."""
        return any(s["estimator"] == estimator and s["seed"] == seed for s in self.summaries)

    def add(self, run: Run, summary: Summary) -> None:
        """Keep a run: its trajectories first, so that what results.json lists is there.

        Raises:
            ValueError: a figure is no finite number; nothing of the run is kept then.
        """
        _check_figures(summary)
        self._write_trajectories(run)
        self.summaries.append(summary)
        _write_json(self.path / "settings.json", self._settings)
        _write_json(self._results, self.summaries)

    def trajectories(self) -> list[RunTrajectories]:
        """The trajectories of all runs, read back."""
        return [self._read_trajectories(s["estimator"], s["seed"]) for s in self.summaries]

    @property
    def _results(self) -> Path:
        return self.path / "results.json"

    def _check_place(self) -> None:
        """Find out before the work, not after it, that its results cannot be written."""
        there = next(
            place for place in (self.path, *self.path.absolute().parents) if place.exists()
        )
        if not (there.is_dir() and os.access(there, os.W_OK)):
            raise ValueError(
                f"results cannot be written to {self.path}: {there} is not a folder that you may "
                "write to; choose another --output"
            )

    def _check_settings(self) -> None:
        kept = _read_json(self.path / "settings.json", dict)
        if kept == self._settings:
            return
        keys = sorted({*kept, *self._settings})
        differing = [
            f"{key} {kept.get(key)!r} (now {self._settings.get(key)!r})"
            for key in keys
            if kept.get(key) != self._settings.get(key)
        ]
        raise ValueError(
            f"{self.path} was begun with other settings: {'; '.join(differing)}; "
            "runs of different settings are not mixed: choose another --output"
        )

    def _check_trajectories(self) -> None:
        """Find out before the work that what is there cannot be reported after it."""
        try:
            self.trajectories()
        except (KeyError, TypeError, OSError, ValueError) as error:
            raise ValueError(
                f"{self._results} cannot be resumed from: it lists a run that is not whole "
                f"({error!r}); choose another --output"
            ) from error

    def _write_trajectories(self, run: Run) -> None:
        name = _file_name(run.estimator, run.seed)
        for folder in ("truth", "with_covariance"):
            (self.path / "trajectories" / folder).mkdir(parents=True, exist_ok=True)
        flat, P = lift(planar(run)), covariances(run)
        poses = spatial(run)
        estimate = Trajectory(run.stamps, flat if poses is None else poses)
        write_tum(self.path / "trajectories" / name, estimate)
        with_covariance = Trajectory(run.stamps, flat, P)
        write_tum(self.path / "trajectories" / "with_covariance" / name, with_covariance)
        if run.true_poses_3d is not None:
            truth = Trajectory(run.stamps, run.true_poses_3d)
            write_tum(self.path / "trajectories" / "truth" / name, truth)

    def _read_trajectories(self, estimator: str, seed: int) -> RunTrajectories:
        folder, name = self.path / "trajectories", _file_name(estimator, seed)
        truth = folder / "truth" / name
        return RunTrajectories(
            estimator,
            seed,
            read_tum(folder / "with_covariance" / name),
            read_tum(truth) if truth.exists() else None,
        )


def _check_figures(summary: Summary) -> None:
    wild = [k for k, v in summary.items() if isinstance(v, float) and not math.isfinite(v)]
    if wild:
        raise ValueError(
            f"{summary['estimator']}, seed {summary['seed']}: {', '.join(wild)} cannot be written "
            "as JSON, for they are no finite numbers; are the estimates? check_pose_estimator tells"
        )


def _file_name(estimator: str, seed: int) -> str:
    return f"{estimator.replace('/', '-')}_seed{seed}.tum"


def _read_json(path: Path, kind: type) -> Any:
    try:
        value = json.loads(path.read_text())
    except (OSError, ValueError) as error:
        raise ValueError(f"{path} cannot be resumed from: {error}") from error
    if not isinstance(value, kind):
        raise ValueError(f"{path} cannot be resumed from: it holds no JSON {kind.__name__}")
    return value


def _write_json(path: Path, value: Any) -> None:
    """Write all or nothing: a reader, or a crash, never sees half of a file."""
    partial = path.with_suffix(".partial")
    partial.write_text(json.dumps(value, indent=2, allow_nan=False, default=_number) + "\n")
    os.replace(partial, path)


def _number(value: Any) -> Any:
    if isinstance(value, np.generic):
        return value.item()
    raise TypeError(f"{value!r} cannot be written as JSON")
