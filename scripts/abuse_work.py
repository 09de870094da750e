"""What `grouser abuse` does: drive once a seed, spoil what was sensed, and see what comes of it."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from rich.table import Table

from grouser.agents.scripted import figure_eight
from grouser.checks import did_you_mean
from grouser.envs.tracked_robot import TrackedRobotEnv
from grouser.estimators import Status, make, registry
from grouser.estimators.base import TRUTH_KEYS, Observation, PoseEstimate, PoseEstimator
from grouser.estimators.evaluation.spoils import SPOILS, spoilt
from grouser.geometry import Array, wrap
from grouser.rig import Rig
from grouser.scripts.abuse import Abuse
from grouser.scripts.terminal import progress, table_console
from grouser.scripts.usage import UsageError, usage_errors

FRAMES, WINDOW = 160, range(60, 90)
_SPOIL_SEED = 5
BEYOND = 22.06
"""chi-square of 3 degrees of freedom that is as rare as 4 sigma of one: 6.3e-5."""


@dataclass(frozen=True, slots=True)
class Outcome:
    """One run."""

    statuses: dict[Status, int]
    """Frames of the window."""
    growth: float
    """Of the place's sigma, over the window."""
    recovery: int | None
    """Frames after the window until it tracks."""
    wrong: int
    """Frames that track and are off beyond 4 sigma."""
    tracking: int
    """Frames that track."""


def outcome(estimates: Sequence[PoseEstimate], truths: Array, window: range) -> Outcome:
    """What came of a window of spoilt frames; truths: (n, 3)."""
    errors = np.array([estimate.pose for estimate in estimates]) - truths
    errors[:, 2] = wrap(errors[:, 2])
    covariances = np.array([estimate.covariance for estimate in estimates])
    far = np.array(
        [error @ np.linalg.pinv(P) @ error for error, P in zip(errors, covariances, strict=True)]
    )
    tracks = np.array([estimate.status is Status.TRACKING for estimate in estimates])
    sigmas = np.sqrt(covariances[:, 0, 0] + covariances[:, 1, 1])
    back = np.flatnonzero(tracks[window.stop :])
    seen = [estimates[index].status for index in window]
    return Outcome(
        statuses={status: seen.count(status) for status in Status},
        growth=float(sigmas[window.stop - 1] / sigmas[window.start - 1]),
        recovery=int(back[0]) if len(back) else None,
        wrong=int(np.sum(tracks[1:] & (far[1:] > BEYOND))),
        tracking=int(np.sum(tracks[1:])),
    )


def run(estimator: PoseEstimator, observations: Sequence[Observation]) -> list[PoseEstimate]:
    """The estimator's view of the observations that it reads."""
    keys = estimator.requires | estimator.optional
    shown = [{key: o[key] for key in keys & set(o)} for o in observations]
    first = estimator.reset(shown[0], rng=np.random.default_rng(0))
    return [first, *(estimator.update(observation) for observation in shown[1:])]


def drive(seed: int, frames: int = FRAMES) -> tuple[Rig, list[Observation], Array]:
    """Rig, observations and true poses (n, 3) of a figure-eight in the yard."""
    env = TrackedRobotEnv(sensors=("left", "right", "tracks", "imu"))
    shown, info = env.reset(seed=seed)
    observations, truths = [shown], [info["true_pose"]]
    act = figure_eight(env.rig)
    for step in range(frames - 1):
        shown, _, _, _, info = env.step(act(step).astype(np.float32))
        observations.append(shown)
        truths.append(info["true_pose"])
    env.close()
    return env.rig, list(observations), np.array(truths)


def abuse(options: Abuse) -> int:
    """Print the table of each estimator, and return the exit code."""
    names, spoils = options.estimators, options.spoils or tuple(SPOILS)
    with usage_errors():
        _check(options)
    with progress("driving", options.seeds * (1 + len(names) * len(spoils))) as bar:
        drives = list(bar.over(drive(seed) for seed in range(options.seeds)))
        for name in names:
            bar.describe(name)
            rows = [
                (spoil, list(bar.over(_spoilt_run(name, spoil, *driven) for driven in drives)))
                for spoil in spoils
            ]
            table_console().print(_table(name, rows))
    return 0


def _check(options: Abuse) -> None:
    if options.seeds < 1:
        raise UsageError(f"--seeds must be at least 1, got {options.seeds}")
    for name in options.estimators:
        registry.spec(name)
        if (sensors := registry.estimator_class(name).requires) & TRUTH_KEYS:
            raise UsageError(f"{name} reads {sorted(sensors)}: nothing of what is spoilt")
    unknown = [spoil for spoil in options.spoils if spoil not in SPOILS]
    if unknown:
        hint = did_you_mean(unknown[0], SPOILS)
        raise UsageError(f"no spoil is named {unknown[0]!r}; {hint}known: {', '.join(SPOILS)}")


def _spoilt_run(
    name: str, spoil: str, rig: Rig, observations: Sequence[Observation], truths: Array
) -> Outcome:
    seen = spoilt(observations, spoil, WINDOW, np.random.default_rng(_SPOIL_SEED))
    return outcome(run(make(name, rig), seen), truths, WINDOW)


def _table(name: str, rows: Sequence[tuple[str, list[Outcome]]]) -> Table:
    drives = len(rows[0][1])
    title = f"{name}, {drives} drives, frames {WINDOW.start} to {WINDOW.stop} spoilt"
    table = Table(title=title, box=None)
    table.add_column("spoil")
    for column in ("tracking", "coasting", "lost", "sigma x", "recovery", "beyond 4 sigma"):
        table.add_column(column, justify="right")
    for spoil, found in rows:
        table.add_row(spoil, *_cells(found))
    return table


def _cells(found: Sequence[Outcome]) -> list[str]:
    frames = [str(sum(o.statuses[status] for o in found)) for status in Status]
    recoveries = [o.recovery for o in found]
    last = "never" if None in recoveries else str(max(r for r in recoveries if r is not None))
    wrong = 100 * sum(o.wrong for o in found) / max(1, sum(o.tracking for o in found))
    return [*frames, f"{np.median([o.growth for o in found]):.1f}", last, f"{wrong:.1f} %"]
