"""The work of `grouser montecarlo`: check what was asked, run it, print and write the scores."""

import json
from collections.abc import Collection, Sequence
from pathlib import Path

from grouser.scripts.montecarlo import MonteCarlo
from grouser.scripts.montecarlo_runs import METHODS, run_all
from grouser.scripts.montecarlo_scenarios import SCENARIOS
from grouser.scripts.montecarlo_score import Score, summarise
from grouser.scripts.montecarlo_table import explanation, score_table
from grouser.scripts.montecarlo_world import WorldOptions
from grouser.scripts.ray_cluster import require_cluster
from grouser.scripts.terminal import progress, table_console
from grouser.scripts.usage import UsageError, usage_errors


def run_and_report(asked: MonteCarlo) -> int:
    """Returns the exit code.

    Raises:
        UsageError: something is asked for that there is not.
    """
    _check(asked)
    scenarios = asked.scenarios or tuple(SCENARIOS)
    methods = asked.methods or tuple(METHODS)
    world = WorldOptions(noise_px=asked.noise_px, outliers=asked.outliers)
    scores: list[Score] = []
    with progress("drives", len(scenarios) * asked.seeds) as bar:
        for of_drive in run_all(
            scenarios, methods, asked.seeds, processes=asked.processes, ray=asked.ray, world=world
        ):
            scores += of_drive
            bar.advance()
    console = table_console()
    console.print(score_table(summarise(scores), scenarios, methods))
    console.print(explanation(methods), style="dim")
    if asked.output is not None:
        _write(asked.output, scores)
    return 0


def _write(path: Path, scores: Sequence[Score]) -> None:
    content = {
        "means": [mean.plain() for mean in summarise(scores).values()],
        "runs": [score.plain() for score in scores],
    }
    path.write_text(json.dumps(content, indent=2) + "\n")


def _check(asked: MonteCarlo) -> None:
    _known("scenario", asked.scenarios, SCENARIOS)
    _known("method", asked.methods, METHODS)
    for name in ("seeds", "processes"):
        if getattr(asked, name) < 1:
            raise UsageError(f"--{name} must be at least 1, got {getattr(asked, name)}")
    if not asked.noise_px > 0:
        raise UsageError(f"--noise-px must be above zero, got {asked.noise_px}")
    if not 0 <= asked.outliers < 1:
        raise UsageError(f"--outliers must be at least 0 and below 1, got {asked.outliers}")
    if asked.ray is not None:
        with usage_errors():
            require_cluster(asked.ray)
    if asked.output is not None and not asked.output.absolute().parent.is_dir():
        folder = asked.output.absolute().parent
        raise UsageError(f"--output: there is no folder {folder}; make it first")


def _known(what: str, asked: Sequence[str], known: Collection[str]) -> None:
    for name in asked:
        if name not in known:
            raise UsageError(f"there is no {what} {name!r}; there are: {', '.join(known)}")
