"""What `grouser evaluate` does with its options: prepare, drive, score, report."""

import os
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console

from grouser import __version__
from grouser.agents.drivers import make_driver
from grouser.agents.episode import Episode, Trial, goal_task, run_trial
from grouser.agents.evaluation import BASELINE, Gap, Score, open_closed_gap, score
from grouser.agents.open_loop import replayed_ate
from grouser.scripts.compare_world import world_options
from grouser.scripts.evaluate import Evaluate
from grouser.scripts.evaluate_folder import EvaluationFolder, Watched, key_of
from grouser.scripts.evaluate_table import gap_words, score_table
from grouser.scripts.ray_cluster import require_cluster
from grouser.scripts.sweep import sweep
from grouser.scripts.terminal import progress, table_console
from grouser.scripts.usage import UsageError, usage_errors


@dataclass(frozen=True, slots=True)
class Piece:
    """A piece of the work: drive an episode, or let an estimator watch one."""

    trial: Trial
    watch: bool


def evaluate(options: Evaluate) -> int:
    """Evaluate, print the table, and return the exit code."""
    console = table_console()
    with usage_errors():
        _check(options)
        folder = EvaluationFolder(_output(options), _settings(options), resume=options.resume)
    finished = _work(options, folder)
    _report(options, folder, console)
    return 0 if finished else 130


def do_piece(piece: Piece) -> Episode | Watched:
    """One piece, here or in another process."""
    trial = piece.trial
    if not piece.watch:
        return run_trial(trial)
    return Watched(trial.policy, trial.estimator, trial.seed, replayed_ate(trial))


def _check(options: Evaluate) -> None:
    """Everything that can be refused is refused here, before any long work."""
    for name in ("episodes", "goals", "processes"):
        value = getattr(options, name)
        if value is not None and value < 1:
            raise UsageError(f"--{name} must be at least 1, got {value}")
    if options.seed < 0:
        raise UsageError(f"--seed must be at least 0, got {options.seed}")
    if options.resume and options.output is None:
        raise UsageError("--resume needs --output: the folder of the results to complete")
    if not options.policy or not options.estimators:
        raise UsageError("--policy and --estimators take one name or more")
    for policy in options.policy:
        for estimator in _driven(options):
            goal_task(make_driver(policy), estimator, task_of(options)).close()
    if options.ray is not None:
        require_cluster(options.ray)


def task_of(options: Evaluate) -> dict[str, Any]:
    """The arguments of `GoalNavEnv`, but those that the driver or the estimator decides."""
    robot = world_options(
        difficulty=options.difficulty,
        terrain=options.terrain,
        randomize=options.randomize,
        dynamics=options.dynamics,
        renderer=None,
        effects=options.effects,
        faults=options.faults,
    )
    return {
        "world": options.world,
        "goals": options.goals,
        "time_limit": options.time_limit,
        "pose_latency": options.pose_latency,
        "robot": robot,
    }


def _settings(options: Evaluate) -> dict[str, Any]:
    """More episodes, estimators or drivers may be added to a folder; its task stays."""
    return {"grouser": __version__, **task_of(options)}


def _output(options: Evaluate) -> Path:
    if options.output is not None:
        return options.output
    return Path("results") / f"evaluate-{options.world}-{datetime.now():%Y%m%d-%H%M%S}"


def _driven(options: Evaluate) -> list[str]:
    """Estimators to drive with: those asked for, and what they are measured against."""
    return list(dict.fromkeys((BASELINE, *options.estimators)))


def _seeds(options: Evaluate) -> range:
    return range(options.seed, options.seed + options.episodes)


def pieces_of(options: Evaluate, folder: EvaluationFolder) -> list[Piece]:
    """What is still to be done, an episode of every estimator before the next one of any."""
    task = task_of(options)
    pieces = []
    for seed in _seeds(options):
        for policy in options.policy:
            for estimator in _driven(options):
                trial = Trial(policy, estimator, seed, task)
                if key_of(trial) not in folder.episodes:
                    pieces.append(Piece(trial, watch=False))
                if options.open_loop and key_of(trial) not in folder.watched:
                    pieces.append(Piece(trial, watch=True))
    return pieces


def _work(options: Evaluate, folder: EvaluationFolder) -> bool:
    """Do it under a progress bar, each piece on disk when it is done; whether it was finished."""
    pieces = pieces_of(options, folder)
    processes = options.processes or len(os.sched_getaffinity(0))
    with progress("episodes", len(pieces)) as bar:
        try:
            for _, done in sweep(do_piece, pieces, processes=processes, ray=options.ray):
                folder.add(done)
                bar.advance()
        except KeyboardInterrupt:
            return False
    return True


def _report(options: Evaluate, folder: EvaluationFolder, console: Console) -> None:
    scores = scores_of(options, folder)
    gaps = gaps_of(options, folder, scores)
    if not scores:
        console.print("interrupted before every estimator had an episode: there are no scores")
        return
    folder.report(scores, gaps)
    console.print(score_table(scores, f"{options.world}, {options.goals} goal(s) an episode"))
    for gap in gaps:
        console.print(gap_words(gap))
    console.print(f"{len(folder.episodes)} episodes in {folder.path}: results.json, episodes.json")


def scores_of(options: Evaluate, folder: EvaluationFolder) -> list[Score]:
    """A score for every driver and estimator that was asked for, over the episodes that all of
    them have finished."""
    scores = []
    for policy in options.policy:
        seeds = [
            seed
            for seed in _seeds(options)
            if all((policy, name, seed) in folder.episodes for name in _driven(options))
        ]
        of_estimator = {
            name: [folder.episodes[policy, name, seed] for seed in seeds]
            for name in _driven(options)
        }
        if seeds:
            truth = of_estimator[BASELINE]
            scores += [score(of_estimator[name], truth) for name in options.estimators]
    return scores


def gaps_of(options: Evaluate, folder: EvaluationFolder, scores: Sequence[Score]) -> list[Gap]:
    """The open-closed gap of every driver, where it was asked for; the true pose takes no part."""
    if not options.open_loop:
        return []
    gaps = []
    for policy in options.policy:
        spl = {s.estimator: s.spl for s in scores if s.policy == policy}
        spl.pop(BASELINE, None)
        if len(spl) > 1:
            gaps.append(open_closed_gap(policy, _mean_ates(options, folder, policy, spl), spl))
    return gaps


def _mean_ates(
    options: Evaluate, folder: EvaluationFolder, policy: str, estimators: Sequence[str] | Any
) -> dict[str, float]:
    keys = {name: [(policy, name, seed) for seed in _seeds(options)] for name in estimators}
    return {
        name: float(np.mean([folder.watched[key].ate_m for key in of if key in folder.watched]))
        for name, of in keys.items()
    }
