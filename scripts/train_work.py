"""What `grouser train` does with its options: prepare, train, report."""

import time
from datetime import datetime
from pathlib import Path
from typing import Any

from grouser import __version__
from grouser.agents.learned import algorithm_class
from grouser.agents.navigation import SHUFFLED
from grouser.estimators.evaluation.folder import (
    require_ready,
    write_settings,
)
from grouser.scripts.terminal import progress, table_console
from grouser.scripts.train import Train
from grouser.scripts.usage import UsageError, usage_errors


def train_policy(options: Train) -> int:
    """Train, say how it went, and return the exit code."""
    with usage_errors():
        training = _prepare(options)
    from grouser.agents.learning.training import train

    console, begun = table_console(), time.monotonic()
    with progress("training", options.steps) as bar:
        shown = _Shown(bar)
        try:
            train(training, shown)
        except KeyboardInterrupt:
            console.print(f"interrupted; --output {training.folder} --resume goes on")
            return 130
    took = time.monotonic() - begun
    console.print(f"{shown.words()}; {took:.0f} s\npolicy: {training.policy}")
    return 0


def _prepare(options: Train) -> Any:
    """Everything that can be refused is refused here, before any long work."""
    if options.steps < 1 or options.seed < 0:
        raise UsageError("--steps must be at least 1, and --seed at least 0")
    if options.resume and options.output is None:
        raise UsageError("--resume needs --output: the folder of the training to go on with")
    algorithm_class(options.algorithm)
    from grouser.agents.learning.task import TrainingTask
    from grouser.agents.learning.training import Training

    task = TrainingTask(
        estimator=options.estimator,
        worlds=options.worlds,
        difficulty=options.difficulty,
        goals=options.goals,
        covariance=_covariance(options),
    )
    for world in task.worlds:
        task.make(world).close()
    folder = options.output or Path("results") / f"train-{datetime.now():%Y%m%d-%H%M%S}"
    settings = {
        "grouser": __version__,
        "algorithm": options.algorithm,
        "steps": options.steps,
        "seed": options.seed,
        **task.settings,
    }
    _enter(folder, settings, resume=options.resume)
    return Training(task, options.algorithm, options.steps, options.seed, folder)


def _covariance(options: Train) -> bool | str:
    if options.covariance and options.shuffled_covariance:
        raise UsageError("--covariance and --shuffled-covariance exclude each other")
    return SHUFFLED if options.shuffled_covariance else options.covariance


def _enter(folder: Path, settings: dict[str, Any], *, resume: bool) -> None:
    """Begin the folder, or go on with one that was begun with the same settings."""
    begun = (folder / "settings.json").exists()
    require_ready(folder, settings, begun=begun, resume=resume, holds=_HELD)
    if not begun:
        folder.mkdir(parents=True, exist_ok=True)
        write_settings(folder, settings)


_HELD = "a training; give --resume to go on with it"


class _Shown:
    """Shows on a bar how far a training is, and remembers it."""

    def __init__(self, bar: Any) -> None:
        self._bar, self._steps = bar, 0
        self._success: float | None = None

    def __call__(self, steps: int, success: float | None) -> None:
        self._bar.advance(steps - self._steps)
        self._steps, self._success = steps, success
        self._bar.describe(self.words())

    def words(self) -> str:
        """How far it is."""
        told = "" if self._success is None else f", the last episodes succeed {self._success:.0%}"
        return f"{self._steps} steps{told}"
