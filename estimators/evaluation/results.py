"""The folder of a comparison: figures and trajectories of every run, written as runs are done.

results.json                              a list with an object a run
settings.json                             what all runs of the folder have in common
trajectories/NAME_seedS.tum               the estimate; 3-D where the estimator gives that
trajectories/truth/NAME_seedS.tum         the truth, where there is one
trajectories/with_covariance/NAME_seedS.tum   the planar estimate, covariance in columns 9 to 14
trajectories/status/NAME_seedS.txt        stamp and status of every frame
"""

import math
from dataclasses import dataclass
from pathlib import Path

from grouser.estimators.base import Status
from grouser.estimators.evaluation.comparison import Run
from grouser.estimators.evaluation.folder import (
    HELD,
    Settings,
    read_json,
    require_ready,
    write_json,
    write_settings,
)
from grouser.estimators.evaluation.summary import Summary, covariances, planar, spatial
from grouser.geometry import lift
from grouser.trajectory import Trajectory, read_tum, write_tum


@dataclass(frozen=True, slots=True)
class RunTrajectories:
    """A run as it is on disk."""

    estimator: str
    seed: int
    estimate: Trajectory
    """Planar, with covariance."""
    truth: Trajectory | None
    statuses: tuple[Status, ...] | None
    """One a frame; None in folders that were written before statuses were kept."""


class ResultsFolder:
    """A folder that holds the runs of one comparison and grows by a run at a time."""

    def __init__(self, path: str | Path, settings: Settings, *, resume: bool = False) -> None:
        """Begin the folder, or go on with one that was begun with the same settings.

        Raises:
            ValueError: the folder cannot be written to, or it holds results already and `resume`
                is not set, or it holds those of other settings, or its files are damaged.
        """
        self.path = Path(path)
        self._settings = settings
        self.summaries: list[Summary] = []
        begun = self._results.exists()
        require_ready(self.path, settings, begun=begun, resume=resume, holds=HELD)
        if begun:
            self.summaries = read_json(self._results, list)
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
        write_settings(self.path, self._settings)
        write_json(self._results, self.summaries)

    def trajectories(self) -> list[RunTrajectories]:
        """The trajectories of all runs, read back."""
        return [self._read_trajectories(s["estimator"], s["seed"]) for s in self.summaries]

    @property
    def _results(self) -> Path:
        return self.path / "results.json"

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
        for folder in ("truth", "with_covariance", "status"):
            (self.path / "trajectories" / folder).mkdir(parents=True, exist_ok=True)
        flat, P = lift(planar(run)), covariances(run)
        poses = spatial(run)
        estimate = Trajectory(run.stamps, flat if poses is None else poses)
        write_tum(self.path / "trajectories" / name, estimate)
        with_covariance = Trajectory(run.stamps, flat, P)
        write_tum(self.path / "trajectories" / "with_covariance" / name, with_covariance)
        _write_statuses(_status_file(self.path, run.estimator, run.seed), run)
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
            _read_statuses(_status_file(self.path, estimator, seed)),
        )


def _check_figures(summary: Summary) -> None:
    wild = [k for k, v in summary.items() if isinstance(v, float) and not math.isfinite(v)]
    if wild:
        raise ValueError(
            f"{summary['estimator']}, seed {summary['seed']}: {', '.join(wild)} cannot be written "
            "as JSON, for they are no finite numbers; are the estimates? check_pose_estimator tells"
        )


def _status_file(path: Path, estimator: str, seed: int) -> Path:
    name = _file_name(estimator, seed).removesuffix(".tum")
    return path / "trajectories" / "status" / f"{name}.txt"


def _write_statuses(path: Path, run: Run) -> None:
    rows = zip(run.stamps, run.estimates, strict=True)
    path.write_text("".join(f"{stamp:.9f} {said.status.value}\n" for stamp, said in rows))


def _read_statuses(path: Path) -> tuple[Status, ...] | None:
    if not path.exists():
        return None
    return tuple(Status(line.split()[1]) for line in path.read_text().splitlines())


def _file_name(estimator: str, seed: int) -> str:
    return f"{estimator.replace('/', '-')}_seed{seed}.tum"
